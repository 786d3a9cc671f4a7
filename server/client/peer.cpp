#include "client/peer.h"

#include <google/protobuf/util/time_util.h>

namespace mbcosim::client {
namespace {

v1::CouplingMode to_proto(Mode mode) {
  switch (mode) {
    case Mode::loose:
      return v1::COUPLING_MODE_LOOSE;
    case Mode::staggered:
      return v1::COUPLING_MODE_STAGGERED;
    case Mode::tight:
      return v1::COUPLING_MODE_TIGHT;
    case Mode::window:
      return v1::COUPLING_MODE_WINDOW;
    default:
      return v1::COUPLING_MODE_UNSPECIFIED;
  }
}

v1::PeerPolicy to_proto(Policy policy) {
  switch (policy) {
    case Policy::hold_last:
      return v1::PEER_POLICY_HOLD_LAST;
    case Policy::zero:
      return v1::PEER_POLICY_ZERO;
    case Policy::wait:
      return v1::PEER_POLICY_WAIT;
    default:
      return v1::PEER_POLICY_FAIL_STEP;
  }
}

v1::Acceleration to_proto(Acceleration acceleration) {
  switch (acceleration) {
    case Acceleration::constant:
      return v1::ACCELERATION_CONSTANT;
    case Acceleration::aitken:
      return v1::ACCELERATION_AITKEN;
    case Acceleration::iqn_ils:
      return v1::ACCELERATION_IQN_ILS;
    default:
      return v1::ACCELERATION_NONE;
  }
}

void take(const v1::ServerExchange& in, Motion& motion) {
  motion.step = in.step();
  motion.time = in.time_s();
  motion.target_time = in.target_time_s();
  motion.iteration = in.iteration();
  motion.x.assign(in.positions_m().begin(), in.positions_m().end());
  motion.R.assign(in.rotations().begin(), in.rotations().end());
  motion.v.assign(in.velocities_m_s().begin(), in.velocities_m_s().end());
  motion.w.assign(in.angular_velocities_rad_s().begin(), in.angular_velocities_rad_s().end());
  motion.signals.assign(in.signals().begin(), in.signals().end());
}

v1::PeerMessage to_message(std::int64_t index, const Loads& loads) {
  v1::PeerMessage message;
  v1::PeerExchange* out = message.mutable_exchange();
  out->set_index(index);
  out->mutable_forces_n()->Add(loads.forces.begin(), loads.forces.end());
  out->mutable_moments_nm()->Add(loads.moments.begin(), loads.moments.end());
  out->mutable_signals()->Add(loads.signals.begin(), loads.signals.end());
  return message;
}

v1::PeerMessage failure_message(std::int64_t index, const std::string& why) {
  v1::PeerMessage message;
  message.mutable_exchange()->set_index(index);
  message.mutable_exchange()->set_failure(why.empty() ? "the peer gave no reason" : why);
  return message;
}

}  // namespace

v1::Hello make_hello(const v1::SimulationInfo& simulation, const std::string& port,
                     const PeerOptions& options) {
  v1::Hello hello;
  hello.mutable_protocol()->set_lowest(1);
  hello.mutable_protocol()->set_highest(1);
  hello.set_simulation(simulation.name());
  hello.set_port(port);
  hello.set_model_digest(simulation.model_digest());
  hello.set_rotation_form(v1::ROTATION_FORM_MATRIX);
  hello.set_mode(to_proto(options.mode));
  hello.set_every(options.every);
  *hello.mutable_peer_timeout() = google::protobuf::util::TimeUtil::MillisecondsToDuration(
      static_cast<std::int64_t>(options.timeout * 1000));
  hello.set_policy(to_proto(options.policy));
  hello.set_acceleration(to_proto(options.acceleration));
  hello.set_relaxation(options.relaxation);
  hello.set_interface_tolerance(options.tolerance);
  hello.set_maximum_passes(options.maximum_passes);
  hello.set_length_unit("m");
  return hello;
}

std::unique_ptr<Peer::Impl> attach_peer(std::shared_ptr<Server::Impl> server,
                                        const v1::Hello& hello) {
  auto impl = std::make_unique<Peer::Impl>();
  impl->server = std::move(server);
  impl->stream = impl->server->coupling->Attach(&impl->context);
  v1::PeerMessage first;
  *first.mutable_hello() = hello;
  if (impl->stream->Write(first) && impl->stream->Read(&impl->in)) return impl;
  impl->open = false;
  require(impl->stream->Finish());
  throw Error("the server ended the handshake", static_cast<int>(grpc::StatusCode::UNAVAILABLE), "",
              {});
}

bool Peer::Impl::next(Motion& motion) {
  while (stream->Read(&in)) {
    if (!in.has_exchange()) continue;  // heartbeats, ends of implicit steps
    take(in.exchange(), motion);
    ++exchanges;
    return true;
  }
  return false;
}

void Peer::Impl::send(v1::PeerMessage message) { stream->Write(message); }

void Peer::Impl::serve(Answer answer) {
  thread = std::thread([this, answer = std::move(answer)] {
    Motion motion;
    while (next(motion)) {
      const std::int64_t index = in.exchange().index();
      try {
        send(to_message(index, answer(motion)));
      } catch (const std::exception& error) {
        send(failure_message(index, error.what()));
      }
    }
  });
}

void Peer::Impl::close() {
  if (!open) return;
  open = false;
  context.TryCancel();  // ends a read that is under way
  if (thread.joinable()) thread.join();
  stream->Finish();
}

Peer::Peer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Peer::Peer(Peer&&) noexcept = default;
Peer& Peer::operator=(Peer&&) noexcept = default;
Peer::~Peer() = default;

bool Peer::next(Motion& motion) { return impl_->next(motion); }
void Peer::answer(const Loads& loads) {
  impl_->send(to_message(impl_->in.exchange().index(), loads));
}
void Peer::fail(const std::string& why) {
  impl_->send(failure_message(impl_->in.exchange().index(), why));
}
std::int64_t Peer::exchanges() const { return impl_->exchanges; }
void Peer::close() { impl_->close(); }

}  // namespace mbcosim::client
