/// mbcosim-peer: `mbcosim peer` hands over to it.
#include <grpcpp/support/status_code_enum.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>

#include "mbdyn/link.h"
#include "options/address_checks.h"
#include "options/number_checks.h"
#include "peer/options.h"
#include "threads/interrupt.h"

namespace mbcosim::peer {
namespace {

constexpr int kDone = 0, kRefused = 4, kPeerLost = 5, kInterrupted = 130;

void add_call(CLI::App& app, PeerCall& call) {
  app.add_option("--simulation", call.simulation, "Name of the simulation")->required();
  app.add_option("--port", call.port, "Name of its port")->required();
  server::add_daemon_options(app, call.daemon);
  app.add_option("--mode", call.mode, "When to exchange; default: as the port says")
      ->check(CLI::IsMember({"loose", "staggered", "tight", "window"}));
  app.add_option("--peer-timeout", call.timeout, "Longest wait for the simulation or the code [s]")
      ->capture_default_str()
      ->check(server::NumberCheck::within(1e-3, 1e6));
}

/// "unix:PATH" or "HOST:PORT"
ChannelAddress address_of(const std::string& text, bool create) {
  ChannelAddress address;
  address.create = create;
  if (text.rfind("unix:", 0) == 0) {
    address.kind = ChannelAddress::Kind::local;
    address.path = text.substr(5);
    return address;
  }
  if (!server::is_host_and_port(text, 1))
    throw std::runtime_error("an address is unix:PATH or HOST:PORT, got \"" + text + "\"");
  const std::size_t colon = text.rfind(':');
  address.kind = ChannelAddress::Kind::tcp;
  address.host = text.substr(0, colon);
  address.port = std::stoi(text.substr(colon + 1));
  return address;
}

/// Where codes are met, as the command line has it.
struct AddressTexts {
  std::string listen, connect, inputs_listen, inputs_connect;
};

void add_addresses(CLI::App& app, AddressTexts& texts) {
  auto* listens = app.add_option("--listen", texts.listen, "unix:PATH or HOST:PORT for the code");
  app.add_option("--connect", texts.connect, "unix:PATH or HOST:PORT where the code listens")
      ->excludes(listens);
  auto* inputs = app.add_option("--inputs-listen", texts.inputs_listen,
                                "Signal port: unix:PATH or HOST:PORT for the code that sends the "
                                "inputs; default: the one that gets the outputs");
  app.add_option("--inputs-connect", texts.inputs_connect,
                 "Signal port: unix:PATH or HOST:PORT where the code that sends the inputs listens")
      ->excludes(inputs);
}

void add_socket(CLI::App& app, SocketCall& socket) {
  app.add_option("--protocol", socket.protocol,
                 "mbdyn: that of MBDyn's external forces and streams")
      ->required()
      ->check(CLI::IsMember({"mbdyn"}));
  app.add_option("--orientation", socket.rotation, "Form of rotations")
      ->capture_default_str()
      ->check(CLI::IsMember({"none", "vector", "matrix", "euler123"}));
  auto* labels = app.add_flag("--labels", socket.labels, "Labels of nodes travel, too");
  app.add_flag("--unsorted", socket.unsorted,
               "Labels of the answers are those of the points, in any order")
      ->needs(labels);
  app.add_flag(
      "--padded-labels", socket.pads_labels,
      "The code pads labels of an odd number of points, as MBDyn does: it does not use its "
      "client library, which misreads them");
  app.add_flag("--global-reference-loads", socket.global_reference_loads,
               "Loads on the reference node come in the global frame, as with `rotate reference "
               "node forces, no`");
  app.add_flag("--accelerations", socket.accelerations, "Accelerations travel, too");
}

void set_addresses(const AddressTexts& texts, SocketCall& socket) {
  if (texts.listen.empty() && texts.connect.empty())
    throw std::runtime_error("give either --listen or --connect");
  const auto read = [](const std::string& listen, const std::string& connect) {
    return address_of(listen.empty() ? connect : listen, !listen.empty());
  };
  socket.address = read(texts.listen, texts.connect);
  if (!texts.inputs_listen.empty() || !texts.inputs_connect.empty())
    socket.inputs = read(texts.inputs_listen, texts.inputs_connect);
}

int run(int argc, char** argv, const CancelToken* interrupt) {
  CLI::App app{"Takes part in a simulation of a daemon.", "mbcosim peer"};
  app.require_subcommand(1);
  PeerCall call;
  call.interrupt = interrupt;
  FmuCall fmu;
  std::vector<std::string> pairs;
  CLI::App* fmu_app = app.add_subcommand("fmu", "An FMU is the peer of a signal port");
  fmu_app->add_option("file", fmu.file, "The FMU, of FMI 2.0 or 3.0 for co-simulation")->required();
  fmu_app->add_option(
      "--map", pairs,
      "NAME=SIGNAL: an input or output of the FMU, of an array also NAME[k], and its signal");
  add_call(*fmu_app, call);
  SocketCall socket;
  AddressTexts texts;
  CLI::App* socket_app =
      app.add_subcommand("socket", "A code that speaks another protocol is the peer");
  add_addresses(*socket_app, texts);
  add_socket(*socket_app, socket);
  add_call(*socket_app, call);
  app.footer(
      "Exit codes: 0 the simulation is gone, 4 refused, 5 the code, the FMU or the daemon is "
      "missing "
      "or lost, 130 interrupted.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kRefused;
  }
  if (fmu_app->parsed()) {
    for (const std::string& pair : pairs) {
      const std::size_t equals = pair.find('=');
      if (equals == std::string::npos)
        throw std::runtime_error("--map takes NAME=SIGNAL, got \"" + pair + "\"");
      fmu.map[pair.substr(0, equals)] = pair.substr(equals + 1);
    }
    serve_fmu(call, fmu);
    return kDone;
  }
  set_addresses(texts, socket);
  serve_socket(call, socket);
  return kDone;
}

}  // namespace
}  // namespace mbcosim::peer

int main(int argc, char** argv) {
  using namespace mbcosim::peer;
  const mbcosim::InterruptGuard interrupt;
  const auto complain = [&interrupt](const std::exception& error, int code) {
    if (interrupt.token()->cancelled()) return kInterrupted;
    std::fprintf(stderr, "mbcosim peer: %s\n", error.what());
    return code;
  };
  try {
    const int code = run(argc, argv, interrupt.token());
    return interrupt.token()->cancelled() ? kInterrupted : code;
  } catch (const mbcosim::mbdyn::ChannelLost& lost) {
    return complain(lost, kPeerLost);
  } catch (const Lost& lost) {
    return complain(lost, kPeerLost);
  } catch (const mbcosim::client::Error& error) {
    const bool lost = error.code() == static_cast<int>(grpc::StatusCode::UNAVAILABLE);
    return complain(error, lost ? kPeerLost : kRefused);
  } catch (const std::exception& error) {
    return complain(error, kRefused);
  }
}
