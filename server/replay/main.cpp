/// mbcosim-replay: `mbcosim replay` hands over to it.
#include <grpcpp/server_builder.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "daemon/listener.h"
#include "host/addresses.h"
#include "options/address_checks.h"
#include "options/number_checks.h"
#include "replay/model_replay.h"
#include "replay/record_file.h"
#include "replay/server_replay.h"

namespace mbcosim::replay {
namespace {

constexpr int kSame = 0, kDiffers = 1, kRefused = 2, kUsage = 4;

int tell(const std::string& difference, const std::string& done) {
  if (difference.empty()) {
    std::printf("same: %s\n", done.c_str());
    return kSame;
  }
  std::printf("first difference: %s\n", difference.c_str());
  return kDiffers;
}

int run_model(const std::string& deck, const std::vector<v1::RecordEntry>& record,
              double tolerance) {
  const Outcome outcome = replay_model(deck, record, tolerance);
  if (!outcome.end.empty()) std::printf("note: the replay ends early: %s\n", outcome.end.c_str());
  return tell(outcome.difference, std::to_string(outcome.steps) + " steps, " +
                                      std::to_string(outcome.exchanges) + " exchanges");
}

/// Nothing is wrong with the record.
class CannotServe : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws CannotServe when the address cannot be had.
server::Listener listener_at(const std::string& address) try {
  return server::Listener(address);
} catch (const std::runtime_error& error) {
  throw CannotServe(error.what());
}

int run_server(const std::string& address, const std::vector<v1::RecordEntry>& record,
               double tolerance) {
  RecordedCoupling coupling(record, tolerance);
  if (coupling.sessions() == 0)
    throw std::runtime_error("nobody took part while it was recorded: there is nothing to serve");
  server::Listener listener = listener_at(address);
  RecordedSimulation simulation(record.front().header());
  grpc::ServerBuilder builder;
  auto acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      grpc::InsecureServerCredentials());
  builder.RegisterService(&coupling);
  builder.RegisterService(&simulation);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server) throw CannotServe("the server cannot start");
  listener.start(std::move(acceptor));
  std::printf("waiting for clients on %s\n", listener.bound().c_str());
  std::fflush(stdout);
  coupling.wait();
  listener.stop();
  server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  return tell(coupling.difference(), std::to_string(coupling.exchanges()) + " exchanges");
}

bool is_local(const std::string& address) {
  return address.rfind("unix:", 0) == 0 || server::is_loopback(address);
}

}  // namespace
}  // namespace mbcosim::replay

int main(int argc, char** argv) {
  using namespace mbcosim::replay;
  CLI::App app{
      "Replays what crossed the ports of a simulation and reports the first difference by step and "
      "variable. A record is what "
      "`GetRecord` gives for a simulation that was created with `record_ports`.",
      "mbcosim replay"};
  std::string deck, record, address;
  double tolerance = 0;
  app.add_option("record", record, "The record")->required();
  app.add_option("deck", deck, "Main file of the deck: the model is run against the record");
  app.add_option("--serve", address,
                 "unix:PATH or HOST:PORT of this machine: the recorded server is played to clients")
      ->check(mbcosim::server::AddressCheck::of_host_or_file());
  app.add_option("--tolerance", tolerance,
                 "Relative difference of numbers that is let pass; default: none")
      ->check(mbcosim::server::NumberCheck::at_least(0));
  app.footer(
      "Exit code: 0 the same, 1 different, 2 record or deck refused, 4 wrong usage, or the address "
      "cannot be had.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kSame : kUsage;
  }
  const auto refuse = [](const std::string& why, int code) {
    std::fprintf(stderr, "mbcosim replay: %s\n", why.c_str());
    return code;
  };
  if (deck.empty() == address.empty()) return refuse("give either a deck or --serve", kUsage);
  if (!address.empty() && !is_local(address))
    return refuse("--serve takes addresses of this machine only, got \"" + address + "\"", kUsage);
  try {
    const auto entries = read_record(record);
    return address.empty() ? run_model(deck, entries, tolerance)
                           : run_server(address, entries, tolerance);
  } catch (const CannotServe& error) {
    return refuse(error.what(), kUsage);
  } catch (const std::exception& error) {
    return refuse(error.what(), kRefused);
  }
}
