/// mbcosim-fmu: `mbcosim fmu` hands over to it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "fmi/exporter.h"
#include "fmi/remote_address.h"
#include "input/symbol_values.h"
#include "options/number_checks.h"

namespace mbcosim::fmi {
namespace {

constexpr int kDone = 0, kDeckRefused = 2, kRefused = 4;

/// Beside this program, or where it is installed.
std::string find_library() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path here = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& path :
       {here / MBCOSIM_FMU_LIBRARY, here / MBCOSIM_FMU_LIBRARY_FOLDER / MBCOSIM_FMU_LIBRARY})
    if (fs::exists(path, error)) return fs::weakly_canonical(path).string();
  return MBCOSIM_FMU_LIBRARY;
}

int export_and_tell(const ExportOptions& options) {
  ExportReport report;
  const auto done = export_fmu(options, report);
  for (const Diagnostic& d : report.diagnostics) {
    const std::string text = d.text();
    std::fprintf(stderr, "%s%s", text.c_str(), text.ends_with('\n') ? "" : "\n");
  }
  if (!done) {
    std::fprintf(stderr, "mbcosim fmu: %s\n", done.error().message.c_str());
    return done.error().kind == ErrorKind::deck ? kDeckRefused : kRefused;
  }
  std::printf("%s: FMI %s, %d inputs, %d outputs, %d parameters\n", options.output.c_str(),
              options.standard == Standard::fmi2 ? "2.0" : "3.0", report.inputs, report.outputs,
              report.parameters);
  return kDone;
}

}  // namespace
}  // namespace mbcosim::fmi

int main(int argc, char** argv) {
  using namespace mbcosim::fmi;
  CLI::App app{"Makes a co-simulation FMU of a deck, with the engine inside.", "mbcosim fmu"};
  ExportOptions options;
  app.add_option("deck", options.deck, "Main file of the deck")->required();
  app.add_option("-o,--output", options.output, "Name of the FMU; default: that of the deck");
  std::string standard = "3";
  app.add_option("--fmi", standard, "Version of the standard")
      ->capture_default_str()
      ->check(CLI::IsMember({"2", "3"}));
  app.add_option("--inputs", options.selection.inputs,
                 "Variables to write, names or patterns with * and ?; default: inputs of ports and "
                 "stream drives")
      ->delimiter(',');
  app.add_option("--outputs", options.selection.outputs,
                 "Variables to read, names or patterns with * and ?; default: all")
      ->delimiter(',');
  app.add_option_function<std::vector<std::string>>(
         "-D",
         [&](const std::vector<std::string>& definitions) {
           for (const std::string& definition : definitions) {
             auto symbol = mbcosim::parse_symbol(definition);
             if (!symbol) throw CLI::ValidationError("-D", symbol.error().message);
             options.symbols.insert_or_assign(std::move(symbol->first), std::move(symbol->second));
           }
         },
         "Value of a symbol of the deck: NAME=VALUE; repeatable")
      ->take_all();
  app.add_option("--remote", options.remote,
                 "http://HOST:PORT of a daemon's HTTP door: it takes the steps, not the engine "
                 "inside; not for decks with ports on which it would wait for a peer")
      ->check([](const std::string& address) {
        const auto parsed = parse_remote(address);
        return parsed ? "" : parsed.error().message;
      });
  app.add_option("--remote-timeout", options.remote_timeout, "Longest wait for the daemon [s]")
      ->capture_default_str()
      ->check(mbcosim::server::NumberCheck::within(0.1, 1e6));
  app.footer("Exit codes: 0 done, 2 deck refused, 4 wrong usage, or the file cannot be written.");
  try {
    app.parse(argc, argv);
    options.standard = standard == "2" ? Standard::fmi2 : Standard::fmi3;
    if (options.output.empty())
      options.output = std::filesystem::path(options.deck).filename().replace_extension(".fmu");
    options.library = find_library();
    return export_and_tell(options);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kRefused;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "mbcosim fmu: %s\n", e.what());
    return kRefused;
  }
}
