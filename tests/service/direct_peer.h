/// A peer in the test's process, which answers within `send`.
#pragma once

#include <functional>
#include <utility>

#include "coupling/coupler.h"

namespace mbcosim::server {

/// Attached to a port while it lives.
class DirectPeer : public PeerLink {
 public:
  using Answer = std::function<void(const v1::ServerExchange&, v1::PeerExchange*)>;
  DirectPeer(Port& port, v1::CouplingMode mode, Answer answer)
      : DirectPeer(port, agreement_of(mode), std::move(answer)) {}
  DirectPeer(Port& port, const Agreement& agreement, Answer answer)
      : port_(port), answer_(std::move(answer)) {
    port_.reserve(agreement);
    port_.attach(this, {});
  }
  ~DirectPeer() override { port_.detach(); }
  DirectPeer(const DirectPeer&) = delete;
  DirectPeer& operator=(const DirectPeer&) = delete;

  bool send(const v1::ServerMessage& message, std::chrono::steady_clock::time_point,
            const CancelToken&) override {
    accepted += message.has_accepted();
    rejected += message.has_rejected();
    if (!message.has_exchange()) return true;
    ++exchanges;
    v1::PeerExchange answer;
    answer.set_index(message.exchange().index());
    answer_(message.exchange(), &answer);
    port_.deliver(answer);
    return true;
  }

  int exchanges = 0, accepted = 0, rejected = 0;  ///< messages so far

 private:
  static Agreement agreement_of(v1::CouplingMode mode) {
    Agreement agreement;
    agreement.mode = mode;
    return agreement;
  }

  Port& port_;
  const Answer answer_;
};

/// Gives the mass of thrown_mass() the force of a spring of 8 N/m to the origin.
inline void pull_back(const v1::ServerExchange& motion, v1::PeerExchange* answer) {
  answer->mutable_answer()->add_signals(-8 * motion.signals(0));
}

/// Port "spring" of thrown_mass(): the position goes out, the force comes in.
inline google::protobuf::RepeatedPtrField<v1::PortDefinition> spring_port() {
  google::protobuf::RepeatedPtrField<v1::PortDefinition> ports;
  v1::PortDefinition* port = ports.Add();
  port->set_name("spring");
  port->set_kind(v1::PORT_KIND_SIGNAL);
  port->add_output_variables("node.structural.1.X");
  port->add_input_variables("node.parameter.2.x");
  return ports;
}

}  // namespace mbcosim::server
