#include "fmi/exporter.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "fmi/archive.h"
#include "fmi/description.h"
#include "fmi/needed_libraries.h"
#include "math/hash.h"

namespace mbcosim::fmi {
namespace {

namespace fs = std::filesystem;

Error refused(ErrorKind kind, const std::string& message) { return make_error(kind, "", message); }

/// Hands out files and keeps what was read.
class RecordingSource : public FileSource {
 public:
  explicit RecordingSource(const FileSource& source) : source_(source) {}
  Result<std::string> read(const std::string& name) const override {
    auto content = source_.read(name);
    if (content) files_[name] = *content;
    return content;
  }
  const std::map<std::string, std::string>& files() const { return files_; }

 private:
  const FileSource& source_;
  mutable std::map<std::string, std::string> files_;
};

/// ErrorKind::argument when the FMU would take the place of a file that the deck consists of.
mbcosim::Status check_inputs(const std::map<std::string, std::string>& read, const fs::path& folder,
                             const std::string& output) {
  std::vector<std::string> inputs;
  for (const auto& [name, content] : read) inputs.push_back((folder / name).string());
  const std::string input = file_in_both(inputs, {output});
  if (input.empty()) return ok();
  return refused(ErrorKind::argument,
                 "the FMU would overwrite \"" + input +
                     "\", which the deck consists of\n  hint: choose another name with `-o`");
}

/// A name that a C compiler would take: letters, digits and underscores.
std::string identifier_of(const std::string& stem) {
  std::string name;
  for (const unsigned char c : stem)
    name += std::isalnum(c) && c < 128 ? static_cast<char>(c) : '_';
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0]))) name = "_" + name;
  return name;
}

/// Equal decks and variables make equal tokens; as a GUID of 128 bits.
std::string make_token(const Manifest& manifest, const std::string& variables) {
  const std::uint64_t first = fnv1a(manifest.digest + variables);
  return "{" + manifest.digest + "-" + digest_text(first) + "}";
}

std::optional<Error> unfit(const Model& model) {
  const InitialValueSettings& s = model.initial_value;
  if (s.abort_after != InitialValueSettings::AbortAfter::never)
    return refused(ErrorKind::argument, "the deck stops before its first step (`abort after`)");
  if (!(s.final_time >= s.initial_time))
    return refused(ErrorKind::argument, "the deck's final time lies before its initial time");
  return std::nullopt;
}

Result<std::string> read_whole(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return refused(ErrorKind::io, "cannot read \"" + path + "\"");
  return std::string(std::istreambuf_iterator<char>(in), {});
}

/// The engine and what it needs, into the folder of the platform.
mbcosim::Status add_binaries(const ExportOptions& options, const std::string& identifier,
                             std::map<std::string, std::string>& archive) {
  const std::string folder =
      options.standard == Standard::fmi2 ? "binaries/linux64/" : "binaries/x86_64-linux/";
  const auto needed = needed_libraries(options.library);
  if (!needed) return needed.error();
  std::map<std::string, std::string> files = *needed;
  files[identifier + ".so"] = options.library;
  for (const auto& [name, path] : files) {
    auto content = read_whole(path);
    if (!content) return content.error();
    archive[folder + name] = std::move(*content);
  }
  return ok();
}

/// The deck's files under names of ours: theirs may lead anywhere.
void add_files(const std::map<std::string, std::string>& files, Manifest& manifest,
               std::map<std::string, std::string>& archive) {
  int count = 0;
  for (const auto& [name, content] : files) {
    const std::string path =
        "files/" + std::to_string(++count) + "-" + fs::path(name).filename().string();
    manifest.files[name] = path;
    archive["resources/" + path] = content;
  }
}

DescriptionHead head_of(const ExportOptions& options, const Model& model,
                        const std::string& token) {
  const InitialValueSettings& s = model.initial_value;
  const std::string stem = fs::path(options.output).stem().string();
  return {stem,           identifier_of(stem), token,       model.title,
          s.initial_time, s.final_time,        s.time_step, s.strategy != StepStrategy::factor};
}

void count(const std::vector<Entry>& entries, ExportReport& report) {
  for (const Entry& e : entries) {
    if (e.symbol) {
      ++report.parameters;
      continue;
    }
    report.inputs += e.variable.role == FmuVariable::Role::input ? 1 : 0;
    report.outputs += e.variable.role == FmuVariable::Role::output ? 1 : 0;
    report.parameters += e.variable.role == FmuVariable::Role::tunable ? 1 : 0;
  }
}

/// Can XML 1.0 hold it?
bool is_text(const std::string& text) {
  const auto is_control = [](char c) {
    return static_cast<unsigned char>(c) < ' ' && c != '\t' && c != '\n' && c != '\r';
  };
  if (std::any_of(text.begin(), text.end(), is_control)) return false;
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {  // it is not UTF-8
    return false;
  }
}

/// What the description cannot tell.
std::optional<Error> untold(const Model& model, const std::map<std::string, std::string>& files,
                            const std::vector<Entry>& entries) {
  const auto error = [](const std::string& what) {
    return make_error(ErrorKind::argument, "",
                      what +
                          " is not UTF-8, or has control characters, which the description of an "
                          "FMU (XML) cannot hold");
  };
  for (const auto& [name, content] : files)
    if (!is_text(name)) return error("the name of a file of the deck");
  if (!is_text(model.title)) return error("the title of the deck");
  for (const Entry& e : entries) {
    const auto* const text = e.symbol ? std::get_if<std::string>(&e.symbol->start) : nullptr;
    if (text && !is_text(*text)) return error("the value of the symbol \"" + e.symbol->name + "\"");
  }
  return std::nullopt;
}

}  // namespace

mbcosim::Status export_fmu(const ExportOptions& options, ExportReport& report) {
  const fs::path path(options.deck);
  const FolderSource folder(path.has_parent_path() ? path.parent_path().string() : ".",
                            /*unrestricted=*/true);
  const RecordingSource source(folder);
  const std::string main_file = path.filename().string();
  const DeckReport loaded = read_deck(source, main_file, {.symbols = options.symbols});
  report.diagnostics = loaded.diagnostics;
  if (!loaded.ok()) return refused(ErrorKind::deck, "the deck is refused");
  const auto kept = check_inputs(source.files(), path.parent_path(), options.output);
  if (!kept) return kept.error();
  const Model& model = *loaded.model;
  if (const auto error = unfit(model)) return *error;
  const auto simulation = Simulation::prepare(loaded.model);
  auto entries = make_catalogue(*simulation, options.selection);
  if (!entries) return entries.error();
  const bool arrays = options.standard == Standard::fmi3;
  if (!arrays) *entries = as_scalars(*entries);
  add_symbols(loaded.symbols, options.symbols, *entries);
  count(*entries, report);
  if (const auto error = untold(model, source.files(), *entries)) return *error;

  Manifest manifest;
  std::map<std::string, std::string> archive;
  manifest.deck = main_file;
  manifest.digest = digest_text(model.digest);
  manifest.remote = options.remote;
  manifest.remote_timeout = options.remote_timeout;
  for (const Entry& e : *entries)
    if (e.symbol)
      manifest.symbols.push_back(*e.symbol);
    else
      manifest.variables.push_back(e.variable);
  add_files(source.files(), manifest, archive);
  manifest.token = make_token(manifest, to_json(manifest));
  const DescriptionHead head = head_of(options, model, manifest.token);
  archive["resources/mbcosim.json"] = to_json(manifest);
  archive["modelDescription.xml"] =
      arrays ? describe_fmi3(head, *entries) : describe_fmi2(head, *entries);
  if (std::string terminals = arrays ? describe_terminals(*entries) : ""; !terminals.empty())
    archive["terminalsAndIcons/terminalsAndIcons.xml"] = std::move(terminals);
  if (auto added = add_binaries(options, head.identifier, archive); !added) return added.error();
  return write_archive(options.output, archive);
}

}  // namespace mbcosim::fmi
