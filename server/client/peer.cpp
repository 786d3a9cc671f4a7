#include "client/peer.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <system_error>

#include "client/convert.h"
#include "client/deadline.h"

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

v1::RotationForm to_proto(Rotation rotation) {
  switch (rotation) {
    case Rotation::vector:
      return v1::ROTATION_FORM_VECTOR;
    case Rotation::quaternion:
      return v1::ROTATION_FORM_QUATERNION;
    case Rotation::euler_123:
      return v1::ROTATION_FORM_EULER_123;
    default:
      return v1::ROTATION_FORM_MATRIX;
  }
}

v1::PortFrame to_proto(Frame frame) {
  switch (frame) {
    case Frame::global:
      return v1::PORT_FRAME_GLOBAL;
    case Frame::node:
      return v1::PORT_FRAME_NODE;
    case Frame::reference:
      return v1::PORT_FRAME_REFERENCE;
    default:
      return v1::PORT_FRAME_UNSPECIFIED;
  }
}

v1::InputHold to_proto(Hold hold) {
  switch (hold) {
    case Hold::linear:
      return v1::INPUT_HOLD_LINEAR;
    case Hold::quadratic:
      return v1::INPUT_HOLD_QUADRATIC;
    default:
      return v1::INPUT_HOLD_ZERO_ORDER;
  }
}

v1::TangentForm to_proto(Tangent form) {
  switch (form) {
    case Tangent::block_diagonal:
      return v1::TANGENT_FORM_BLOCK_DIAGONAL;
    case Tangent::dense:
      return v1::TANGENT_FORM_DENSE;
    default:
      return v1::TANGENT_FORM_NONE;
  }
}

std::int64_t nanoseconds_now() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

using Numbers = google::protobuf::RepeatedField<double>;

void take(const Numbers& numbers, std::vector<double>& out) {
  out.assign(numbers.begin(), numbers.end());
}

void take(const v1::ServerExchange& in, Motion& motion) {
  motion.step = in.step();
  motion.time = in.time();
  motion.target_time = in.target_time();
  motion.target_estimated = in.target_estimated();
  motion.iteration = in.iteration();
  take(in.positions(), motion.x);
  take(in.rotations(), motion.R);
  take(in.velocities(), motion.v);
  take(in.angular_velocities(), motion.w);
  take(in.accelerations(), motion.a);
  take(in.angular_accelerations(), motion.wp);
  take(in.signals(), motion.signals);
  take(in.forces(), motion.forces);
  take(in.moments(), motion.moments);
  take(in.reference_position(), motion.reference.x);
  take(in.reference_rotation(), motion.reference.R);
  take(in.reference_velocity(), motion.reference.v);
  take(in.reference_angular_velocity(), motion.reference.w);
  take(in.reference_acceleration(), motion.reference.a);
  take(in.reference_angular_acceleration(), motion.reference.wp);
}

void put(const std::vector<double>& values, Numbers* out) {
  out->Clear();
  out->Add(values.begin(), values.end());
}

void put_tangent(const Loads& loads, Tangent form, v1::PeerAnswer* out) {
  out->clear_tangent();
  if (loads.stiffness.empty() && loads.damping.empty()) return;
  put(loads.stiffness, out->mutable_tangent()->mutable_stiffness());
  put(loads.damping, out->mutable_tangent()->mutable_damping());
  out->mutable_tangent()->set_block_diagonal(form == Tangent::block_diagonal);
}

void put(const Loads& loads, v1::PeerAnswer* out) {
  put(loads.forces, out->mutable_forces());
  put(loads.moments, out->mutable_moments());
  put(loads.signals, out->mutable_signals());
  put(loads.reference_force, out->mutable_reference_force());
  put(loads.reference_moment, out->mutable_reference_moment());
  put(loads.positions, out->mutable_positions());
  put(loads.rotations, out->mutable_rotations());
  out->set_unfinished(loads.unfinished);
}

}  // namespace

PortLayout to_layout(const v1::PortLayout& from) {
  PortLayout layout;
  layout.name = from.name();
  layout.modal = from.kind() == v1::PORT_KIND_MODAL;
  layout.motion = from.kind() == v1::PORT_KIND_MOTION;
  layout.node_labels.assign(from.node_labels().begin(), from.node_labels().end());
  layout.point_labels.assign(from.point_labels().begin(), from.point_labels().end());
  if (from.has_reference_node_label()) layout.reference_node = from.reference_node_label();
  layout.reference_loads = from.reference_loads();
  if (from.has_mapped_points()) layout.mapped_points = from.mapped_points();
  layout.outputs.assign(from.output_names().begin(), from.output_names().end());
  layout.inputs.assign(from.input_names().begin(), from.input_names().end());
  layout.mode_numbers.assign(from.mode_numbers().begin(), from.mode_numbers().end());
  layout.output_units.assign(from.output_units().begin(), from.output_units().end());
  layout.input_units.assign(from.input_units().begin(), from.input_units().end());
  if (from.has_units()) layout.units = to_units(from.units());
  return layout;
}

/// A server that does not know a choice would take the answers otherwise.
void require_features(const v1::VersionRange& server, const PeerOptions& options) {
  if (!options.following_loads && !options.global_reference_loads) return;
  for (const std::string& feature : server.features())
    if (feature == "following_loads") return;
  throw Error(
      "the server is too old: it knows neither loads that follow a node nor global loads "
      "on a reference node in another frame",
      static_cast<int>(grpc::StatusCode::UNIMPLEMENTED), "", {});
}

v1::Hello make_hello(const v1::SimulationInfo& simulation, const std::string& port,
                     const PeerOptions& options) {
  v1::Hello hello;
  fill_protocol(hello.mutable_protocol());
  hello.set_simulation(simulation.name());
  hello.set_port(port);
  hello.mutable_expected()->set_model_digest(simulation.model_digest());
  if (options.step) hello.mutable_expected()->set_step(*options.step);
  hello.mutable_expected()->set_can_go_back(options.can_go_back);
  if (options.units) *hello.mutable_units() = to_proto(*options.units);
  v1::ExchangeForm* form = hello.mutable_form();
  form->set_rotation_form(to_proto(options.rotation));
  form->set_frame(to_proto(options.frame));
  form->set_accelerations(options.accelerations);
  form->set_following_loads(options.following_loads);
  form->set_global_reference_loads(options.global_reference_loads);
  v1::ExchangeSchedule* schedule = hello.mutable_schedule();
  schedule->set_mode(to_proto(options.mode));
  if (options.every) schedule->set_every(*options.every);
  schedule->set_input_hold(to_proto(options.hold));
  v1::InterfaceIteration* iteration = hello.mutable_iteration();
  iteration->set_tangent(to_proto(options.tangent));
  iteration->set_acceleration(to_proto(options.acceleration));
  iteration->set_relaxation(options.relaxation);
  iteration->set_tolerance(options.tolerance);
  iteration->set_maximum_passes(options.maximum_passes);
  v1::PeerPresence* presence = hello.mutable_presence();
  *presence->mutable_peer_timeout() = to_duration(options.peer_timeout, "peer_timeout");
  presence->set_policy(to_proto(options.policy));
  const auto beats = to_duration(options.heartbeat_timeout, "heartbeat_timeout");
  if (options.heartbeat_timeout > 0) *presence->mutable_heartbeat_timeout() = beats;
  (void)to_duration(options.server_timeout, "server_timeout");  // or it is refused
  if (options.server_timeout > 0) {
    double interval = options.server_timeout / 3;
    if (options.heartbeat_timeout > 0) interval = std::min(interval, options.heartbeat_timeout);
    *presence->mutable_heartbeat_interval() = to_duration(interval, "heartbeat_interval");
  }
  return hello;
}

std::unique_ptr<Peer::Impl> attach_peer(std::shared_ptr<Server::Impl> server,
                                        const v1::Hello& hello, const PeerOptions& options) {
  std::unique_ptr<Wire> wire = options.transport == Transport::shared_memory
                                   ? open_shared_memory(*server, options.peer_timeout)
                                   : open_stream(*server, hello.simulation());
  auto impl = std::make_unique<Peer::Impl>();
  impl->wire = std::move(wire);
  impl->server = std::move(server);
  impl->step_ended = options.step_ended;
  v1::PeerMessage first;
  *first.mutable_hello() = hello;
  const Deadline deadline(options.timeout, [&wire = *impl->wire] { wire.cancel(); });
  if (impl->wire->write(first) && impl->wire->read(&impl->in)) {
    require_features(impl->in.welcome().protocol(), options);
    impl->tangent = options.tangent;
    impl->layout = to_layout(impl->in.welcome().layout());
    impl->step =
        std::min(options.step.value_or(impl->in.welcome().step()), impl->in.welcome().step());
    impl->start_heart(options);
    return impl;
  }
  impl->open = false;
  if (deadline.is_over())
    throw Error("attaching the peer took longer than " + std::to_string(options.timeout) + " s",
                static_cast<int>(grpc::StatusCode::DEADLINE_EXCEEDED), "", {});
  require(impl->wire->finish());
  throw Error("the server ended the handshake", static_cast<int>(grpc::StatusCode::UNAVAILABLE), "",
              {});
}

bool Peer::Impl::next(Motion& motion) {
  while (read()) {
    if (in.has_exchange()) {
      take(in.exchange(), motion);
      ++exchanges;
      return true;
    }
    if (in.has_accepted()) note(in.accepted(), true);
    if (in.has_rejected()) note(in.rejected(), false);
  }
  return false;
}

// Pieces of a step may have been accepted before it is rejected.
void Peer::Impl::note(const v1::StepNotice& notice, bool accepted) {
  step = accepted ? notice.step() : std::min(step.load(), notice.step());
  if (step_ended) step_ended(accepted, notice.step(), notice.time());
}

void Peer::Impl::answer(const Loads& loads) {
  out.mutable_exchange()->set_index(in.exchange().index());
  v1::PeerAnswer* answer = out.mutable_exchange()->mutable_answer();
  put(loads, answer);
  put_tangent(loads, tangent, answer);
  if (in.exchange().iteration() == 0) step = in.exchange().step();
  write(out);
}

void Peer::Impl::write(const v1::PeerMessage& message) {
  const server::Guard guard(write_mutex);
  if (!parted) wire->write(message);
}

void Peer::Impl::part() {
  const server::Guard guard(write_mutex);
  parted = true;
  if (!ended) wire->part();
}

void Peer::Impl::start_heart(const PeerOptions& options) {
  const double beats = options.heartbeat_timeout, limit = options.server_timeout;
  if (beats <= 0 && limit <= 0) return;
  heart = std::thread([this, beats, limit] { beat(beats, limit); });
}

// Sends the peer's signs of life, and looks whether the server gives some; bounds in seconds.
void Peer::Impl::beat(double beats, double limit) {
  const double shorter = beats > 0 && limit > 0 ? std::min(beats, limit) : std::max(beats, limit);
  const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(shorter / 3));
  v1::PeerMessage message;
  while (!stop.stopped_within(period)) {
    const std::int64_t since = reading_since.load();
    if (limit > 0 && since > 0 && nanoseconds_now() - since > 1e9 * limit) {
      blame(Error("the server was silent for " + std::to_string(limit) + " s",
                  static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {}));
      wire->cancel();
    }
    if (beats <= 0) continue;
    message.mutable_heartbeat()->set_count(message.heartbeat().count() + 1);
    write(message);
  }
}

bool Peer::Impl::read() {
  if (ended) return false;
  reading_since.store(nanoseconds_now());
  const bool open_still = wire->read(&in);
  reading_since.store(0);
  if (!open_still) end();
  return open_still;
}

void Peer::Impl::end() {
  if (ended.exchange(true)) return;
  const grpc::Status status = wire->finish();
  if (status.error_code() == grpc::StatusCode::CANCELLED) return;  // by this side
  try {
    require(status);
  } catch (const Error& error) {
    blame(error);
  }
}

void Peer::Impl::blame(const Error& error) {
  const server::Guard guard(blame_mutex);
  if (!failure) failure = error;
}

std::optional<Error> Peer::Impl::error() const {
  const server::Guard guard(blame_mutex);
  return failure;
}

void Peer::Impl::stop_heart() {
  stop.stop();
  if (heart.joinable()) heart.join();
}

void Peer::Impl::fail(const std::string& why) {
  v1::PeerMessage message;
  message.mutable_exchange()->set_index(in.exchange().index());
  message.mutable_exchange()->set_failure(why.empty() ? "the peer gave no reason" : why);
  write(message);
}

void Peer::Impl::reject(const Reject& rejection) {
  v1::PeerMessage message;
  message.mutable_exchange()->set_index(in.exchange().index());
  v1::Rejection* reject = message.mutable_exchange()->mutable_reject();
  if (rejection.preferred_step_size != 0)
    reject->set_preferred_step_size(rejection.preferred_step_size);
  reject->set_text(rejection.text);
  write(message);
}

void Peer::Impl::serve(Answer function) {
  thread = std::thread([this, function = std::move(function)] {
    try {
      answer_all(function);
    } catch (const std::exception& error) {
      give_up(error.what());
    } catch (...) {
      give_up("something was thrown that is no exception");
    }
  });
}

void Peer::Impl::answer_all(const Answer& function) {
  Motion motion;
  while (next(motion)) {
    try {
      answer(function(motion));
    } catch (const Reject& rejection) {
      reject(rejection);
    } catch (const std::exception& error) {
      fail(error.what());
    }
  }
}

void Peer::Impl::give_up(const std::string& why) {
  blame(Error("the peer's own code failed: " + why, static_cast<int>(grpc::StatusCode::ABORTED), "",
              {}));
  wire->cancel();
}

void Peer::Impl::close() {
  if (!open) return;
  if (thread.get_id() == std::this_thread::get_id())
    throw Error("a peer cannot be closed by its own function, which has to return first",
                static_cast<int>(grpc::StatusCode::FAILED_PRECONDITION), "", {});
  open = false;
  std::optional<Deadline> deadline;
  try {
    deadline.emplace(kPartingSeconds, [this] { wire->cancel(); });
  } catch (const std::system_error&) {  // no thread to be had
    wire->cancel();
  }
  stop_heart();
  part();
  if (thread.joinable()) thread.join();
  while (read()) {
  }
}

Peer::Peer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Peer::Peer(Peer&&) noexcept = default;
Peer& Peer::operator=(Peer&&) noexcept = default;
Peer::~Peer() = default;

bool Peer::next(Motion& motion) { return impl_->next(motion); }
std::optional<Error> Peer::error() const { return impl_->error(); }
void Peer::answer(const Loads& loads) { impl_->answer(loads); }
void Peer::fail(const std::string& why) { impl_->fail(why); }
void Peer::reject(const Reject& rejection) { impl_->reject(rejection); }
std::int64_t Peer::exchanges() const { return impl_->exchanges; }
std::int64_t Peer::step() const { return impl_->step; }
const PortLayout& Peer::layout() const { return impl_->layout; }
void Peer::interrupt() { impl_->wire->cancel(); }
void Peer::close() { impl_->close(); }

}  // namespace mbcosim::client
