/// mbcosim-view: shows a deck in a browser. `mbcosim view` hands over to it.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "client/mbcosim_client.h"
#include "options/address_checks.h"
#include "view/private_daemon.h"

namespace {

constexpr int kDeckRefused = 2, kRefused = 4, kLost = 5;
constexpr double kStartSeconds = 30;

void block_signals() {  // before any thread starts, so that only the wait below sees them
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

std::string daemon_program() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return (self.parent_path() / "mbcosimd").string();
}

void show(const std::string& deck, const std::string& http) {
  mbcosim::view::PrivateDaemon daemon(daemon_program(), http, kStartSeconds);
  auto server = mbcosim::client::Server::connect(daemon.address(), kStartSeconds);
  mbcosim::client::LoadOptions options;
  options.display_name = std::filesystem::path(deck).filename().string();
  const auto simulation = server.load(deck, options);
  std::printf("%s#simulation=%s\nCtrl-C ends it.\n", daemon.page().c_str(),
              simulation.name().c_str());
  std::fflush(stdout);
  daemon.wait();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Show a deck in a browser: starts a daemon of its own and prints the address.",
               "mbcosim view"};
  std::string deck, http = "127.0.0.1:0";
  app.add_option("deck", deck, "Main file of the deck")->required();
  app.add_option("--http", http, "HOST:PORT of the page; port 0: any that is free")
      ->capture_default_str()
      ->check(mbcosim::server::AddressCheck::of_host());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kRefused;
  }
  block_signals();
  try {
    show(deck, http);
    return 0;
  } catch (const mbcosim::client::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return error.reason() == "DECK_ERROR" ? kDeckRefused : kRefused;
  } catch (const mbcosim::view::Lost& error) {
    std::fprintf(stderr, "mbcosim view: error: %s\n", error.what());
    return kLost;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mbcosim view: error: %s\n", error.what());
    return kRefused;
  }
}
