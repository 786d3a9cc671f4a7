/// The bytes of MBDyn's external forces: handshake, states, loads. Host byte order (little-endian),
/// IEEE doubles, no padding but what is stated. Source: MBDyn input manual, external forces, and
/// what a peer sees on the wire.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "simulation/point_motion.h"

namespace mbcosim::mbdyn {

/// One byte before each message.
enum Command : char {
  kData = 2,      ///< data follow, more exchanges come in this step
  kNoData = 4,    ///< of the peer: keep the last loads, next step
  kEnd = 5,       ///< end of the run; of the peer: after this step
  kLastData = 6,  ///< data follow, the last exchange of this step
  kNegotiate = 7,
  kAccepted = 8
};

/// What an element and its peer agree on.
struct ForceForm {
  enum class Kind { nodal, mapped, modal } kind = Kind::nodal;
  enum class Rotation { none, vector, matrix, euler123 } rotation = Rotation::matrix;
  bool reference = false;  ///< reference node; modal: the modal node takes part
  bool accelerations = false;
  bool labels = false;
  bool sorted = true;       ///< labels of the peer come in the order of the deck
  std::uint32_t count = 0;  ///< points, or modes
  int modes = 0;            ///< that travel
  /// The user says that the peer pads labels of an odd number of points, as MBDyn does; its client
  /// library misreads them.
  bool pads_labels = false;
  /// Of a reference node whose points have no rotations: MBDyn has none there, its client library
  /// has the one that its flags name.
  Rotation reference_rotation = Rotation::none;
  std::uint32_t reference_label = 0;
  std::vector<std::uint32_t> node_labels, point_labels;  ///< (points)

  int points() const { return kind == Kind::modal ? 0 : static_cast<int>(count); }
};

struct ForceState {
  PointState reference;
  std::vector<PointState> points;  ///< relative to the reference when there is one
  std::vector<double> q, qp;       ///< amplitudes of modes and their rates
};

struct ForceLoads {
  Vec3 f0 = Vec3::Zero(), m0 = Vec3::Zero();  ///< on the reference or modal node
  std::vector<Vec3> f, m;                     ///< of the points
  std::vector<double> p;                      ///< of the modes
};

constexpr std::size_t kRequestSize = 8;  ///< flags and count, after kNegotiate

/// Flags and count as the side that connects sends them.
std::string encode_request(const ForceForm& form);
/// Compares a peer's request with ours. Empty: they agree, and `form` has what the peer's own flags
/// say about its library. Otherwise every mismatch with both values, and what they leave open.
std::string check_request(const std::string& request, ForceForm& form);

std::string encode_state(const ForceForm& form, const ForceState& state);
std::size_t loads_size(const ForceForm& form);
/// Throws ChannelLost for labels that do not belong and numbers that are not finite.
ForceLoads decode_loads(const ForceForm& form, const std::string& bytes);

}  // namespace mbcosim::mbdyn
