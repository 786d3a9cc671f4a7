/// mbcosim-sessions: what a daemon has. `mbcosim sessions`, `checkpoint` and `resume` hand over to
/// it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/mbcosim_client.h"
#include "durable/record_file.h"
#include "durable/salvage.h"
#include "reach/daemon_options.h"

namespace {

using namespace mbcosim::client;
using mbcosim::server::reach;

constexpr int kDone = 0, kRefused = 4;

struct Options {
  mbcosim::server::DaemonOptions daemon;
  std::string simulation, file, name;
  bool from_checkpoint = false;
};

const char* state_name(SimulationInfo::State state) {
  constexpr const char* kNames[] = {"unknown",  "ready",  "stepping",
                                    "finished", "failed", "suspended"};
  return kNames[state];
}

int list(const Options& options) {
  const std::vector<SimulationInfo> found = reach(options.daemon).list();
  std::printf("%-42s %-10s %12s %14s  %s\n", "simulation", "state", "step", "time", "name");
  for (const SimulationInfo& info : found)
    std::printf("%-42s %-10s %12lld %14.6g  %s\n", info.name.c_str(), state_name(info.state),
                static_cast<long long>(info.step), info.time, info.display_name.c_str());
  return kDone;
}

/// Under another name until all of it is there.
void write_file(const std::string& path, const std::string& bytes) {
  const std::string making = path + ".new";
  std::ofstream file(making, std::ios::binary);
  file << bytes;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(making, path, error);
  if (!file || error) {
    const std::string why = error ? ": " + error.message() : "";
    std::filesystem::remove(making, error);
    throw std::runtime_error("cannot write " + path + why);
  }
}

int checkpoint(const Options& options) {
  Server server = reach(options.daemon);
  const std::string bytes = server.find(options.simulation).export_checkpoint();
  write_file(options.file, bytes);
  std::printf("%s: %zu bytes\n", options.file.c_str(), bytes.size());
  return kDone;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  if (!file) throw std::runtime_error("cannot read " + path);
  return bytes.str();
}

/// Of a folder with damaged files, what is whole, when that is wanted.
std::string salvaged(const Options& options) {
  using namespace mbcosim::server;
  const Salvage found = named(options.file, [&] { return salvage(options.file); });
  std::ostringstream lost;
  for (const std::string& damage : found.left_out)
    lost << "  " << options.file << '/' << damage << '\n';
  if (found.left_out.empty()) return found.bytes;
  if (!options.from_checkpoint) {
    std::ostringstream text;
    text << "damaged:\n"
         << lost.str() << "`--from-checkpoint` leaves that out: it goes on at step "
         << found.info.step() << ", t = " << found.info.time();
    throw std::runtime_error(text.str());
  }
  std::fprintf(stderr, "left out:\n%s", lost.str().c_str());
  return found.bytes;
}

int resume(const Options& options) {
  const bool is_folder = std::filesystem::is_directory(options.file);
  if (options.from_checkpoint && !is_folder)
    throw std::runtime_error(
        "--from-checkpoint is for a folder DIR/simulations/ID.damaged, which \"" + options.file +
        "\" is not");
  const std::string bytes = is_folder ? salvaged(options) : "";
  Server server = reach(options.daemon);
  if (!is_folder && options.file.compare(0, 12, "simulations/") == 0) {
    Simulation simulation = server.find(options.file);
    (void)simulation.read("step");  // what needs the state brings it back
    std::printf("%s\n", simulation.name().c_str());
    return kDone;
  }
  const Simulation made =
      server.import_checkpoint(is_folder ? bytes : bytes_of(options.file), options.name);
  std::printf("%s\n", made.name().c_str());
  return kDone;
}

CLI::App* add(CLI::App& app, const char* name, const char* text, Options& options) {
  CLI::App* command = app.add_subcommand(name, text);
  mbcosim::server::add_daemon_options(*command, options.daemon);
  return command;
}

int run(int argc, char** argv) {
  CLI::App app{"Simulations of a daemon.", "mbcosim"};
  app.require_subcommand(1);
  Options options;
  int (*chosen)(const Options&) = nullptr;
  CLI::App* sessions =
      add(app, "sessions", "List a daemon's simulations, suspended ones too", options);
  sessions->callback([&] { chosen = list; });
  CLI::App* store = add(app, "checkpoint", "Store all of a daemon's simulation in a file", options);
  store->add_option("simulation", options.simulation, "simulations/NAME")->required();
  store->add_option("-o,--output", options.file, "The file")->required();
  store->callback([&] { chosen = checkpoint; });
  CLI::App* back = add(app, "resume",
                       "Make a simulation of such a file, or bring a suspended one back", options);
  back->add_option("file", options.file,
                   "The file, simulations/NAME, or a folder of the state folder that was put aside")
      ->required();
  back->add_flag(
      "--from-checkpoint", options.from_checkpoint,
      "Of such a folder, leave out what is damaged: it goes on from the last checkpoint, "
      "or the last whole entry of its journal");
  back->add_option("--name", options.name, "Name for people; default: that of the original");
  back->callback([&] { chosen = resume; });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kRefused;
  }
  return chosen(options);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mbcosim: error: %s\n", error.what());
    return kRefused;
  }
}
