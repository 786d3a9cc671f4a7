#include "mbdyn/force_message.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "mbdyn/link.h"

namespace mbcosim::mbdyn {
namespace {

using FormKind = ForceForm::Kind;
using Rotation = ForceForm::Rotation;

enum Flag : std::uint32_t {
  kModal = 0x1,
  kNodal = 0x2,
  kReference = 0x4,
  kAccelerations = 0x8,
  kLabels = 0x10,
  kRotationVector = 0x100,
  kRotationMatrix = 0x200,
  kRotationEuler = 0x400,
  kRotations = 0x700,
  kReferenceShift = 4,  ///< bits from the form of the points to that of the reference node
  kReferenceRotations = 0x7000
};

std::uint32_t rotation_flag(Rotation rotation) {
  switch (rotation) {
    case Rotation::vector:
      return kRotationVector;
    case Rotation::matrix:
      return kRotationMatrix;
    case Rotation::euler123:
      return kRotationEuler;
    default:
      return 0;
  }
}

Rotation rotation_of_flags(std::uint32_t flags) {
  if ((flags & kRotationMatrix) != 0) return Rotation::matrix;
  if ((flags & kRotationVector) != 0) return Rotation::vector;
  return (flags & kRotationEuler) != 0 ? Rotation::euler123 : Rotation::none;
}

/// The bits that a listening side expects.
std::uint32_t flags_of(const ForceForm& form) {
  std::uint32_t flags = form.kind == FormKind::modal ? kModal : kNodal;
  if (form.reference) flags |= kReference;
  if (form.kind == FormKind::modal) return flags;
  if (form.accelerations) flags |= kAccelerations;
  if (form.labels) flags |= kLabels;
  const std::uint32_t rotation = rotation_flag(form.rotation);
  return flags | (form.kind == FormKind::nodal ? rotation : rotation << kReferenceShift);
}

template <class T>
void put(T value, std::string& out) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put(const Vec3& v, std::string& out) {
  for (int i = 0; i < 3; ++i) put(v(i), out);
}

void put_rotation(const Mat3& R, Rotation form, std::string& out) {
  constexpr double kDegrees = 180 / M_PI;
  if (form == Rotation::matrix)
    for (int k = 0; k < 9; ++k) put(R.data()[k], out);  // by columns
  if (form == Rotation::vector) put(vector_of_rotation(R), out);
  if (form == Rotation::euler123) put(Vec3(kDegrees * euler123_of_rotation(R)), out);
}

template <class T>
T take(const std::string& bytes, std::size_t& at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  at += sizeof value;
  return value;
}

double take_number(const std::string& bytes, std::size_t& at) {
  const double value = take<double>(bytes, at);
  if (!std::isfinite(value)) throw ChannelLost("a load is not finite");
  return value;
}

Vec3 take_vector(const std::string& bytes, std::size_t& at) {
  Vec3 v;
  for (int i = 0; i < 3; ++i) v(i) = take_number(bytes, at);
  return v;
}

bool has_padding(const ForceForm& form) { return form.labels && form.points() % 2 != 0; }
bool has_rotations(const ForceForm& form) { return form.rotation != Rotation::none; }
Rotation reference_rotation(const ForceForm& form) {
  return has_rotations(form) ? form.rotation : form.reference_rotation;
}
bool has_moments(const ForceForm& form) {
  return form.kind == FormKind::nodal && has_rotations(form);
}

bool has_reference_moment(const ForceForm& form) {
  return form.kind == FormKind::modal || reference_rotation(form) != Rotation::none;
}

/// Of a mapping's reference node the rotation always travels.
void put_reference(const ForceForm& form, const PointState& r, std::string& out) {
  if (form.labels) {
    put(form.reference_label, out);
    put(std::uint32_t{0}, out);
  }
  const Rotation rotation = reference_rotation(form);
  put(r.x, out);
  put_rotation(r.R, rotation, out);
  put(r.v, out);
  if (rotation != Rotation::none) put(r.w, out);
  if (!form.accelerations) return;
  put(r.a, out);
  if (rotation != Rotation::none) put(r.wp, out);
}

void put_labels(const ForceForm& form, std::string& out) {
  if (!form.labels) return;
  for (const std::uint32_t label : form.node_labels) put(label, out);
  if (has_padding(form)) put(std::uint32_t{0}, out);
}

void put_points(const ForceForm& form, const std::vector<PointState>& points, std::string& out) {
  const bool rotations = form.kind == FormKind::nodal && has_rotations(form);
  for (const PointState& p : points) put(p.x, out);
  if (rotations)
    for (const PointState& p : points) put_rotation(p.R, form.rotation, out);
  for (const PointState& p : points) put(p.v, out);
  if (rotations)
    for (const PointState& p : points) put(p.w, out);
  if (!form.accelerations) return;
  for (const PointState& p : points) put(p.a, out);
  if (rotations)
    for (const PointState& p : points) put(p.wp, out);
}

std::string encode_modal(const ForceForm& form, const ForceState& state) {
  std::string out;
  if (form.reference) {
    put(state.reference.x, out);
    put_rotation(state.reference.R, Rotation::matrix, out);
    put(state.reference.v, out);
    put(state.reference.w, out);
  }
  for (const double q : state.q) put(q, out);
  for (const double qp : state.qp) put(qp, out);
  return out;
}

/// Place in the message -> point. MBDyn's order is the deck's; without `sorted` the peer's labels
/// tell, and each point gets the load that came with its label.
std::vector<int> take_labels(const ForceForm& form, const std::string& bytes, std::size_t& at) {
  std::vector<int> order;
  for (int k = 0; k < form.points(); ++k) {
    order.push_back(k);
    if (!form.labels) continue;
    const auto label = take<std::uint32_t>(bytes, at);
    const auto refuse = [&](const char* what) {
      throw ChannelLost("label " + std::to_string(label) + " of point " + std::to_string(k + 1) +
                        what);
    };
    if (form.sorted && label != form.node_labels[k])
      refuse((" is not " + std::to_string(form.node_labels[k])).c_str());
    if (form.sorted) continue;
    const auto known = std::find(form.point_labels.begin(), form.point_labels.end(), label);
    if (known == form.point_labels.end()) refuse(" belongs to no point");
    order[k] = static_cast<int>(known - form.point_labels.begin());
    if (std::find(order.begin(), order.end() - 1, order[k]) != order.end() - 1)
      refuse(" comes twice");
  }
  if (has_padding(form)) take<std::uint32_t>(bytes, at);
  return order;
}

void take_reference(const ForceForm& form, const std::string& bytes, std::size_t& at,
                    ForceLoads& loads) {
  if (form.labels) {
    const auto label = take<std::uint32_t>(bytes, at);
    take<std::uint32_t>(bytes, at);
    if (label != form.reference_label)
      throw ChannelLost("label " + std::to_string(label) + " of the reference node is not " +
                        std::to_string(form.reference_label));
  }
  loads.f0 = take_vector(bytes, at);
  if (has_reference_moment(form)) loads.m0 = take_vector(bytes, at);
}

/// MBDyn's client library announces itself by the rotation of its reference node; without such a
/// node its flags are those of any code. Empty: it is clear how the peer speaks.
std::string adapt(std::uint32_t flags, ForceForm& form) {
  const std::uint32_t announced = flags & kReferenceRotations;
  if (form.kind != FormKind::nodal) return "";
  if (form.reference && !has_rotations(form))
    form.reference_rotation = rotation_of_flags(announced >> kReferenceShift);
  const bool other_code = form.pads_labels || (form.reference && announced == 0);
  if (!has_padding(form) || other_code) return "";
  return "; labels of an odd number of points: MBDyn's client library misreads them, and the flags "
         "do not tell that the peer is another code; if it is, and pads them as MBDyn does, say so "
         "with --padded-labels, or `padded_labels` in a daemon; else give the deck an even number "
         "of points or no labels";
}

std::string hexadecimal(std::uint32_t number) {
  char text[20];
  std::snprintf(text, sizeof text, "0x%x", number);
  return text;
}

}  // namespace

std::string encode_request(const ForceForm& form) {
  std::string out;
  put(flags_of(form), out);
  put(form.count, out);
  return out;
}

std::string check_request(const std::string& request, ForceForm& form) {
  std::size_t at = 0;
  const auto flags = take<std::uint32_t>(request, at), count = take<std::uint32_t>(request, at);
  const std::uint32_t ours = flags_of(form);
  std::string mismatches;
  const auto compare = [&](const char* what, std::uint32_t mask) {
    if ((flags & mask) != (ours & mask))
      mismatches += std::string("; ") + what + ": the deck has " + hexadecimal(ours & mask) +
                    ", the peer " + hexadecimal(flags & mask);
  };
  compare("kind (1 modal, 2 nodal)", kModal | kNodal);
  compare(form.kind == FormKind::modal ? "rigid part" : "reference node", kReference);
  if (form.kind != FormKind::modal) {
    compare("accelerations", kAccelerations);
    compare("labels", kLabels);
    compare("rotations (0x100 vector, 0x200 matrix, 0x400 Euler angles)", kRotations);
  }
  if (form.kind == FormKind::mapped && form.reference)
    compare("rotation of the reference node", kReferenceRotations);
  if (count != form.count)
    mismatches += "; number of " + std::string(form.kind == FormKind::modal ? "modes" : "points") +
                  ": the deck has " + std::to_string(form.count) + ", the peer " +
                  std::to_string(count);
  if (mismatches.empty()) mismatches = adapt(flags, form);
  return mismatches.empty() ? "" : mismatches.substr(2);
}

std::string encode_state(const ForceForm& form, const ForceState& state) {
  if (form.kind == FormKind::modal) return encode_modal(form, state);
  std::string out;
  if (form.reference) put_reference(form, state.reference, out);
  put_labels(form, out);
  put_points(form, state.points, out);
  return out;
}

std::size_t loads_size(const ForceForm& form) {
  constexpr std::size_t kVector = 3 * sizeof(double), kLabel = sizeof(std::uint32_t);
  if (form.kind == FormKind::modal)
    return (form.reference ? 2 * kVector : 0) + form.modes * sizeof(double);
  std::size_t size = 0;
  if (form.reference) size += kVector + (has_reference_moment(form) ? kVector : 0);
  if (form.reference && form.labels) size += 2 * kLabel;
  if (form.labels) size += kLabel * (form.count + (has_padding(form) ? 1 : 0));
  return size + form.count * (has_moments(form) ? 2 * kVector : kVector);
}

ForceLoads decode_loads(const ForceForm& form, const std::string& bytes) {
  ForceLoads loads;
  std::size_t at = 0;
  if (form.reference) take_reference(form, bytes, at, loads);
  for (int k = 0; k < form.modes; ++k) loads.p.push_back(take_number(bytes, at));
  const std::vector<int> order = take_labels(form, bytes, at);
  loads.f.assign(order.size(), Vec3::Zero());
  loads.m = loads.f;
  for (const int point : order) loads.f[point] = take_vector(bytes, at);
  if (has_moments(form))
    for (const int point : order) loads.m[point] = take_vector(bytes, at);
  return loads;
}

}  // namespace mbcosim::mbdyn
