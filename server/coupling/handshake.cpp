#include "coupling/handshake.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

/// Collects what does not fit in a handshake, so that all of it is told at once.
class Mismatches {
 public:
  void expect(bool fits, const char* what, const std::string& text) {
    if (!fits) found_[what] = text;
  }
  /// The peer stands at a later step than the simulation, and cannot go back.
  void expect_no_later(std::int64_t peers, std::int64_t step, const std::string& port) {
    if (peers <= step) return;
    const std::string at = std::to_string(step), peers_at = std::to_string(peers);
    const std::string text =
        "the peer stands at step " + peers_at + ", the simulation at step " + at;
    found_["step"] = text;
    ahead_.emplace(v1::REASON_PEER_AHEAD,
                   "port \"" + port + "\": " + text + ": take the peer back to step " + at +
                       " and attach it with `can_go_back`, or attach one that begins there",
                   std::map<std::string, std::string>{{"step", at}, {"peer_step", peers_at}});
  }
  void refuse_if_any(const std::string& port) const {
    if (found_.empty()) return;
    if (ahead_ && found_.size() == 1) throw Refusal(*ahead_);
    std::string text = "the handshake does not fit port \"" + port + "\":";
    for (const auto& [what, detail] : found_) text += " " + what + ": " + detail + ";";
    text.pop_back();
    auto metadata = found_;
    const bool versions = found_.count("protocol") > 0;
    if (versions) metadata["lowest"] = metadata["highest"] = std::to_string(kProtocolVersion);
    throw Refusal(versions ? v1::REASON_VERSION_MISMATCH : v1::REASON_PORT_MISMATCH, text,
                  metadata);
  }

 private:
  std::map<std::string, std::string> found_;
  std::optional<Refusal> ahead_;  ///< told when nothing else is wrong
};

Acceleration acceleration_of(v1::Acceleration wanted) {
  switch (wanted) {
    case v1::ACCELERATION_CONSTANT:
      return Acceleration::constant;
    case v1::ACCELERATION_AITKEN:
      return Acceleration::aitken;
    case v1::ACCELERATION_IQN_ILS:
      return Acceleration::iqn_ils;
    default:
      return Acceleration::none;
  }
}

v1::Acceleration to_proto(Acceleration acceleration) {
  constexpr v1::Acceleration kNames[] = {v1::ACCELERATION_NONE, v1::ACCELERATION_CONSTANT,
                                         v1::ACCELERATION_AITKEN, v1::ACCELERATION_IQN_ILS};
  return kNames[static_cast<int>(acceleration)];
}

template <class Enum>
Enum chosen(Enum wanted, Enum fallback) {
  return static_cast<int>(wanted) == 0 ? fallback : wanted;
}

template <class Wanted, class Have>
bool agrees(const Wanted& wanted, const Have& have) {
  return wanted.empty() || std::equal(wanted.begin(), wanted.end(), have.begin(), have.end());
}

void check_simulation(const v1::PeerExpectation& expected, const Expected& simulation,
                      const std::string& port, Mismatches& mismatches) {
  mismatches.expect(expected.model_digest().empty() || expected.model_digest() == simulation.digest,
                    "model_digest",
                    "the model has " + simulation.digest + ", the peer expects " +
                        expected.model_digest().substr(0, 32));
  mismatches.expect(
      !expected.has_step_size() ||
          std::abs(expected.step_size() - simulation.step_size) <= 1e-9 * simulation.step_size,
      "step_size", "the next step has " + std::to_string(simulation.step_size));
  mismatches.expect(expected.step() >= 0, "step", "must not be negative");
  if (!expected.can_go_back()) mismatches.expect_no_later(expected.step(), simulation.step, port);
}

void check_layout(const v1::PeerExpectation& expected, const v1::PortLayout& layout,
                  Mismatches& mismatches) {
  mismatches.expect(
      expected.kind() == v1::PORT_KIND_UNSPECIFIED || expected.kind() == layout.kind(), "kind",
      "the port's is " + v1::PortKind_Name(layout.kind()));
  mismatches.expect(agrees(expected.node_labels(), layout.node_labels()), "node_labels",
                    "the port has other nodes, or in another order");
  mismatches.expect(agrees(expected.output_names(), layout.output_names()), "output_names",
                    "the port has other outputs, or in another order");
  mismatches.expect(agrees(expected.input_names(), layout.input_names()), "input_names",
                    "the port has other inputs, or in another order");
  mismatches.expect(!expected.has_output_size() || expected.output_size() == layout.output_size(),
                    "output_size",
                    "the port sends " + std::to_string(layout.output_size()) + " signals");
  mismatches.expect(!expected.has_input_size() || expected.input_size() == layout.input_size(),
                    "input_size",
                    "the port takes " + std::to_string(layout.input_size()) + " signals");
}

void check_form(const v1::ExchangeForm& form, const PortModel& port, Mismatches& mismatches) {
  mismatches.expect(
      v1::RotationForm_IsValid(form.rotation_form()) && v1::PortFrame_IsValid(form.frame()), "form",
      "a choice is unknown to this server");
  mismatches.expect(!form.accelerations() || port.offers_accelerations(), "accelerations",
                    "not all nodes of the port have them");
  mismatches.expect(
      form.frame() != v1::PORT_FRAME_REFERENCE || port.layout().has_reference_node_label(), "frame",
      "the port has no reference node");
  mismatches.expect(!form.global_reference_loads() || port.layout().reference_loads(),
                    "global_reference_loads", "the port takes no loads on a reference node");
  mismatches.expect(!port.is_motion() || form.frame() <= v1::PORT_FRAME_GLOBAL, "frame",
                    "motion ports count in the global frame");
  mismatches.expect(!port.is_mapped() || form.frame() != v1::PORT_FRAME_NODE, "frame",
                    "mapped points have no frame of their own");
}

void check_schedule(const v1::ExchangeSchedule& schedule, Mismatches& mismatches) {
  mismatches.expect(
      v1::CouplingMode_IsValid(schedule.mode()) && v1::InputHold_IsValid(schedule.input_hold()),
      "schedule", "a choice is unknown to this server");
  mismatches.expect(!schedule.has_every() || schedule.every() >= 1, "every", "must be at least 1");
  mismatches.expect(schedule.mode() != v1::COUPLING_MODE_WINDOW || schedule.every() <= 1, "every",
                    "must be 1 in mode WINDOW");
}

void check_iteration(const v1::InterfaceIteration& iteration, Mismatches& mismatches) {
  mismatches.expect(v1::Acceleration_IsValid(iteration.acceleration()) &&
                        v1::TangentForm_IsValid(iteration.tangent()),
                    "iteration", "a choice is unknown to this server");
  mismatches.expect(
      !iteration.has_relaxation() || (iteration.relaxation() > 0 && iteration.relaxation() < 2),
      "relaxation", "must be in (0, 2)");
  mismatches.expect(!iteration.has_tolerance() ||
                        (iteration.tolerance() > 0 && std::isfinite(iteration.tolerance())),
                    "tolerance", "must be positive");
  mismatches.expect(!iteration.has_maximum_passes() || iteration.maximum_passes() >= 1,
                    "maximum_passes", "must be at least 1");
}

void check_presence(const v1::PeerPresence& presence, Mismatches& mismatches) {
  constexpr std::chrono::milliseconds kShortest(10);
  const auto interval = milliseconds_of(presence.heartbeat_interval(), "heartbeat_interval"),
             timeout = milliseconds_of(presence.heartbeat_timeout(), "heartbeat_timeout");
  mismatches.expect(v1::PeerPolicy_IsValid(presence.policy()), "presence",
                    "a choice is unknown to this server");
  mismatches.expect(
      !presence.has_peer_timeout() ||
          milliseconds_of(presence.peer_timeout(), "peer_timeout") > std::chrono::milliseconds(0),
      "peer_timeout", "must be positive");
  mismatches.expect(!presence.has_heartbeat_interval() || interval >= kShortest,
                    "heartbeat_interval", "must be at least 10 ms");
  mismatches.expect(!presence.has_heartbeat_timeout() || timeout >= std::max(interval, kShortest),
                    "heartbeat_timeout",
                    "must be at least 10 ms and not below `heartbeat_interval`");
}

/// Null: the peer counts in the units of the deck.
std::shared_ptr<const UnitConversion> conversion_of(const v1::Hello& hello, const PortModel& port,
                                                    Mismatches& mismatches) {
  if (!hello.has_units()) return nullptr;
  const UnitSystem units = to_units(hello.units());
  if (const auto fault = check(units)) {
    mismatches.expect(false, ("units." + std::string(fault->member)).c_str(), utf8(fault->text));
    return nullptr;
  }
  mismatches.expect(port.units(), "units",
                    "the deck's are not declared: give `CreateOptions.units` or a card `units`");
  if (!port.units()) return nullptr;
  try {
    return std::make_shared<const UnitConversion>(port.conversion(units));
  } catch (const Refusal& unknown) {
    mismatches.expect(false, "units", unknown.what());
    return nullptr;
  }
}

/// What does not fit together once the defaults are filled in.
void check_agreement(const Agreement& agreement, const PortModel& port, Mismatches& mismatches) {
  mismatches.expect(!port.is_motion() || agreement.policy != v1::PEER_POLICY_ZERO, "policy",
                    "motion has no zero; choose HOLD_LAST");
  mismatches.expect(!agreement.following_loads || agreement.frame > v1::PORT_FRAME_GLOBAL,
                    "following_loads", "the frame is GLOBAL: there is no node that they follow");
  if (agreement.tangent == v1::TANGENT_FORM_NONE) return;
  mismatches.expect(agreement.is_tight(), "tangent", "belongs to mode TIGHT");
  mismatches.expect(port.takes_tangents(), "tangent", "the port takes none");
  mismatches.expect(agreement.frame == v1::PORT_FRAME_GLOBAL, "tangent", "needs the global frame");
  mismatches.expect(agreement.acceleration == Acceleration::none, "acceleration",
                    "has no use with a tangent");
}

Agreement choose(const v1::Hello& hello, const PortModel& port) {
  Agreement agreement;
  const v1::PortLayout& layout = port.layout();
  const v1::ExchangeForm& form = hello.form();
  agreement.rotation_form =
      chosen(form.rotation_form(), chosen(layout.default_rotation_form(), agreement.rotation_form));
  agreement.frame = chosen(form.frame(), chosen(layout.default_frame(), agreement.frame));
  agreement.accelerations = form.accelerations() || port.needs_accelerations();
  agreement.following_loads = form.following_loads();
  agreement.global_reference_loads = form.global_reference_loads();
  const v1::ExchangeSchedule& schedule = hello.schedule();
  agreement.mode = chosen(schedule.mode(), chosen(layout.default_mode(), agreement.mode));
  const bool stepwise =
      agreement.mode == v1::COUPLING_MODE_LOOSE || agreement.mode == v1::COUPLING_MODE_STAGGERED;
  const int usual = stepwise && layout.has_default_every() ? layout.default_every() : 1;
  agreement.every = schedule.has_every() ? schedule.every() : usual;
  agreement.hold = chosen(schedule.input_hold(), agreement.hold);
  const v1::InterfaceIteration& iteration = hello.iteration();
  agreement.acceleration = acceleration_of(iteration.acceleration());
  agreement.tangent = chosen(iteration.tangent(), agreement.tangent);
  if (iteration.has_relaxation()) agreement.relaxation = iteration.relaxation();
  if (iteration.has_tolerance()) agreement.tolerance = iteration.tolerance();
  if (iteration.has_maximum_passes()) agreement.maximum_passes = iteration.maximum_passes();
  const v1::PeerPresence& presence = hello.presence();
  agreement.policy = chosen(presence.policy(), agreement.policy);
  if (presence.has_peer_timeout())
    agreement.timeout = milliseconds_of(presence.peer_timeout(), "peer_timeout");
  agreement.heartbeat_interval =
      milliseconds_of(presence.heartbeat_interval(), "heartbeat_interval");
  agreement.heartbeat_timeout = milliseconds_of(presence.heartbeat_timeout(), "heartbeat_timeout");
  return agreement;
}

}  // namespace

Agreement agree(const v1::Hello& hello, const PortModel& port, const Expected& simulation) {
  Mismatches mismatches;
  const v1::VersionRange& range = hello.protocol();
  if (!is_range(range)) throw Refusal(v1::REASON_BAD_ARGUMENT, kNoRange);
  mismatches.expect(includes_ours(range), "protocol", version_mismatch(range));
  const auto units = conversion_of(hello, port, mismatches);
  Expected in_peers_units = simulation;
  if (units) in_peers_units.step_size *= units->time();
  check_simulation(hello.expected(), in_peers_units, hello.port(), mismatches);
  check_layout(hello.expected(), port.layout(), mismatches);
  check_form(hello.form(), port, mismatches);
  check_schedule(hello.schedule(), mismatches);
  check_iteration(hello.iteration(), mismatches);
  check_presence(hello.presence(), mismatches);
  Agreement agreement = choose(hello, port);
  agreement.units = units;
  check_agreement(agreement, port, mismatches);
  mismatches.refuse_if_any(hello.port());
  return agreement;
}

void fill_agreed(const v1::Hello& hello, const Agreement& agreement, const UnitSystem* deck,
                 v1::Hello* out) {
  using google::protobuf::util::TimeUtil;
  *out = hello;
  fill_protocol(out->mutable_protocol());
  if (!agreement.units && deck) to_proto(*deck, out->mutable_units());
  v1::ExchangeForm* form = out->mutable_form();
  form->set_rotation_form(agreement.rotation_form);
  form->set_frame(agreement.frame);
  form->set_accelerations(agreement.accelerations);
  v1::ExchangeSchedule* schedule = out->mutable_schedule();
  schedule->set_mode(agreement.mode);
  schedule->set_every(agreement.every);
  schedule->set_input_hold(agreement.hold);
  v1::InterfaceIteration* iteration = out->mutable_iteration();
  iteration->set_acceleration(to_proto(agreement.acceleration));
  iteration->set_relaxation(agreement.relaxation);
  iteration->set_tolerance(agreement.tolerance);
  iteration->set_maximum_passes(agreement.maximum_passes);
  iteration->set_tangent(agreement.tangent);
  v1::PeerPresence* presence = out->mutable_presence();
  *presence->mutable_peer_timeout() = TimeUtil::MillisecondsToDuration(agreement.timeout.count());
  presence->set_policy(agreement.policy);
}

}  // namespace mbcosim::server
