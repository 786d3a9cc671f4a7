#include "coupling/handshake.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

std::chrono::milliseconds milliseconds(const google::protobuf::Duration& duration) {
  return std::chrono::milliseconds(
      google::protobuf::util::TimeUtil::DurationToMilliseconds(duration));
}

/// Collects what does not fit in a handshake, so that all of it is told at once.
class Mismatches {
 public:
  void expect(bool fits, const char* what, const std::string& text) {
    if (!fits) found_[what] = text;
  }
  void refuse_if_any(const std::string& port) const {
    if (found_.empty()) return;
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

bool is(const std::string& given, const char* served) { return given.empty() || given == served; }

template <class Wanted, class Have>
bool agrees(const Wanted& wanted, const Have& have) {
  return wanted.empty() || std::equal(wanted.begin(), wanted.end(), have.begin(), have.end());
}

void check_layout(const v1::Hello& hello, const PortModel& port, const std::string& digest,
                  double step_size, Mismatches& mismatches) {
  const v1::PortLayout& layout = port.layout();
  mismatches.expect(
      is(hello.model_digest(), digest.c_str()), "model_digest",
      "the model has " + digest + ", the peer expects " + hello.model_digest().substr(0, 32));
  mismatches.expect(is(hello.length_unit(), "m"), "length_unit", "only \"m\" is served");
  mismatches.expect(is(hello.force_unit(), "N"), "force_unit", "only \"N\" is served");
  mismatches.expect(is(hello.angle_unit(), "rad"), "angle_unit", "only \"rad\" is served");
  mismatches.expect(hello.kind() == v1::PORT_KIND_UNSPECIFIED || hello.kind() == layout.kind(),
                    "kind", "the port's is " + v1::PortKind_Name(layout.kind()));
  mismatches.expect(agrees(hello.node_labels(), layout.node_labels()), "node_labels",
                    "the port has other nodes, or in another order");
  mismatches.expect(agrees(hello.output_names(), layout.output_names()), "output_names",
                    "the port has other outputs, or in another order");
  mismatches.expect(agrees(hello.input_names(), layout.input_names()), "input_names",
                    "the port has other inputs, or in another order");
  mismatches.expect(!hello.has_output_size() || hello.output_size() == layout.output_size(),
                    "output_size",
                    "the port sends " + std::to_string(layout.output_size()) + " signals");
  mismatches.expect(!hello.has_input_size() || hello.input_size() == layout.input_size(),
                    "input_size",
                    "the port takes " + std::to_string(layout.input_size()) + " signals");
  mismatches.expect(
      !(hello.step_size_s() > 0) || std::abs(hello.step_size_s() - step_size) <= 1e-9 * step_size,
      "step_size_s", "the next step has " + std::to_string(step_size) + " s");
  mismatches.expect(!hello.accelerations() || port.offers_accelerations(), "accelerations",
                    "not all nodes of the port have them");
  mismatches.expect(hello.frame() != v1::PORT_FRAME_REFERENCE || layout.has_reference_node_label(),
                    "frame", "the port has no reference node");
  mismatches.expect(!port.is_motion() || hello.frame() <= v1::PORT_FRAME_GLOBAL, "frame",
                    "motion ports count in the global frame");
  mismatches.expect(!port.is_mapped() || hello.frame() != v1::PORT_FRAME_NODE, "frame",
                    "mapped points have no frame of their own");
}

void check_choices(const v1::Hello& hello, Mismatches& mismatches) {
  mismatches.expect(
      v1::CouplingMode_IsValid(hello.mode()) && v1::RotationForm_IsValid(hello.rotation_form()) &&
          v1::PortFrame_IsValid(hello.frame()) && v1::InputHold_IsValid(hello.input_hold()) &&
          v1::PeerPolicy_IsValid(hello.policy()) &&
          v1::Acceleration_IsValid(hello.acceleration()) &&
          v1::TangentForm_IsValid(hello.tangent()),
      "enum", "a choice is unknown to this server");
  mismatches.expect(hello.every() >= 0, "every", "must not be negative");
  mismatches.expect(hello.mode() != v1::COUPLING_MODE_WINDOW || hello.every() <= 1, "every",
                    "must be 1 in mode WINDOW");
  mismatches.expect(hello.relaxation() >= 0 && hello.relaxation() < 2, "relaxation",
                    "must be in (0, 2)");
  mismatches.expect(hello.interface_tolerance() >= 0, "interface_tolerance",
                    "must not be negative");
  mismatches.expect(hello.maximum_passes() >= 0, "maximum_passes", "must not be negative");
  mismatches.expect(!hello.has_peer_timeout() ||
                        milliseconds(hello.peer_timeout()) > std::chrono::milliseconds(0),
                    "peer_timeout", "must be positive");
}

void check_heartbeats(const v1::Hello& hello, Mismatches& mismatches) {
  constexpr std::chrono::milliseconds kShortest(10);
  const auto interval = milliseconds(hello.heartbeat_interval()),
             timeout = milliseconds(hello.heartbeat_timeout());
  mismatches.expect(!hello.has_heartbeat_interval() || interval >= kShortest, "heartbeat_interval",
                    "must be at least 10 ms");
  mismatches.expect(!hello.has_heartbeat_timeout() || timeout >= std::max(interval, kShortest),
                    "heartbeat_timeout",
                    "must be at least 10 ms and not below `heartbeat_interval`");
}

/// What does not fit together once the defaults are filled in.
void check_agreement(const Agreement& agreement, const PortModel& port, Mismatches& mismatches) {
  mismatches.expect(!port.is_motion() || agreement.policy != v1::PEER_POLICY_ZERO, "policy",
                    "motion has no zero; choose HOLD_LAST");
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
  agreement.rotation_form = chosen(hello.rotation_form(),
                                   chosen(layout.default_rotation_form(), agreement.rotation_form));
  agreement.frame = chosen(hello.frame(), chosen(layout.default_frame(), agreement.frame));
  agreement.accelerations = hello.accelerations() || port.needs_accelerations();
  agreement.mode = chosen(hello.mode(), chosen(layout.default_mode(), agreement.mode));
  const bool stepwise =
      agreement.mode == v1::COUPLING_MODE_LOOSE || agreement.mode == v1::COUPLING_MODE_STAGGERED;
  agreement.every =
      std::max({hello.every(), hello.every() == 0 && stepwise ? layout.default_every() : 1, 1});
  agreement.hold = chosen(hello.input_hold(), agreement.hold);
  agreement.policy = chosen(hello.policy(), agreement.policy);
  agreement.acceleration = acceleration_of(hello.acceleration());
  agreement.tangent = chosen(hello.tangent(), agreement.tangent);
  if (hello.has_peer_timeout()) agreement.timeout = milliseconds(hello.peer_timeout());
  agreement.heartbeat_interval = milliseconds(hello.heartbeat_interval());
  agreement.heartbeat_timeout = milliseconds(hello.heartbeat_timeout());
  if (hello.relaxation() > 0) agreement.relaxation = hello.relaxation();
  if (hello.interface_tolerance() > 0) agreement.tolerance = hello.interface_tolerance();
  if (hello.maximum_passes() > 0) agreement.maximum_passes = hello.maximum_passes();
  return agreement;
}

}  // namespace

Agreement agree(const v1::Hello& hello, const PortModel& port, const std::string& digest,
                double step_size) {
  Mismatches mismatches;
  const v1::VersionRange& range = hello.protocol();
  const bool any = range.lowest() == 0 && range.highest() == 0;
  mismatches.expect(
      any || (range.lowest() <= kProtocolVersion && range.highest() >= kProtocolVersion),
      "protocol",
      "the server speaks version 1, the peer " + std::to_string(range.lowest()) + " to " +
          std::to_string(range.highest()));
  check_layout(hello, port, digest, step_size, mismatches);
  check_choices(hello, mismatches);
  check_heartbeats(hello, mismatches);
  const Agreement agreement = choose(hello, port);
  check_agreement(agreement, port, mismatches);
  mismatches.refuse_if_any(hello.port());
  return agreement;
}

void fill_agreed(const v1::Hello& hello, const Agreement& agreement, v1::Hello* out) {
  using google::protobuf::util::TimeUtil;
  *out = hello;
  out->mutable_protocol()->set_lowest(kProtocolVersion);
  out->mutable_protocol()->set_highest(kProtocolVersion);
  out->set_rotation_form(agreement.rotation_form);
  out->set_frame(agreement.frame);
  out->set_accelerations(agreement.accelerations);
  out->set_mode(agreement.mode);
  out->set_every(agreement.every);
  out->set_input_hold(agreement.hold);
  *out->mutable_peer_timeout() = TimeUtil::MillisecondsToDuration(agreement.timeout.count());
  out->set_policy(agreement.policy);
  out->set_acceleration(to_proto(agreement.acceleration));
  out->set_relaxation(agreement.relaxation);
  out->set_interface_tolerance(agreement.tolerance);
  out->set_maximum_passes(agreement.maximum_passes);
  out->set_tangent(agreement.tangent);
}

}  // namespace mbcosim::server
