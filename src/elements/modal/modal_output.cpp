/// Results of the modal joint: .mod and .log lines, private data, inertia.

#include <charconv>
#include <cstdio>
#include <limits>

#include <Eigen/Geometry>

#include "elements/log_text.h"
#include "elements/modal/modal_joint.h"
#include "model/output_row.h"

namespace mbcosim {

namespace {

/// Private data: q, qP, qPP of a mode; position, velocity, acceleration, spin and its rate of a FEM
/// node.
enum DatumKind { kQ, kQP, kQPP, kX, kXP, kXPP, kW, kWP, kDatumCount };
constexpr DatumName kDatumNames[kDatumCount] = {{"q", ""},      {"qP", ""},       {"qPP", ""},
                                                {"x", "m"},     {"xP", "m/s"},    {"xPP", "m/s^2"},
                                                {"w", "rad/s"}, {"wP", "rad/s^2"}};

bool read_integer(std::string_view text, int& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::string_view without_spaces(std::string_view s) {
  while (!s.empty() && s.front() == ' ') s.remove_prefix(1);
  while (!s.empty() && s.back() == ' ') s.remove_suffix(1);
  return s;
}

int mode_index(const ModalBody& body, std::string_view argument) {
  const bool active = !argument.empty() && argument[0] == '#';
  int number = 0;
  if (!read_integer(active ? argument.substr(1) : argument, number)) return -1;
  if (!active) return body.find_mode(number);
  return number >= 1 && number <= body.modes ? number - 1 : -1;
}

int node_component(const ModalBody& body, std::string_view argument) {
  const std::size_t comma = argument.rfind(',');
  if (comma == std::string_view::npos) return -1;
  int component = 0;
  if (!read_integer(without_spaces(argument.substr(comma + 1)), component) || component < 1 ||
      component > 3)
    return -1;
  const int node = body.find_node(without_spaces(argument.substr(0, comma)));
  return node < 0 ? -1 : 3 * node + component - 1;
}

Vec3 node_datum(const ModalBody& b, const FloatingFrame& k, const ModalUnknowns& u, int node,
                int what) {
  const auto U = b.shapes.middleRows(6 * node, 3), V = b.shapes.middleRows(6 * node + 3, 3);
  const Vec3 r = k.R * (b.positions.col(node) + U * u.q), u_rate = k.R * (U * u.p),
             spin = k.R * (V * u.p);
  switch (what) {
    case kX:
      return k.x + r;
    case kXP:
      return k.v + k.w.cross(r) + u_rate;
    case kXPP:
      return k.vp + k.wp.cross(r) + k.w.cross(k.w.cross(r)) + 2 * k.w.cross(u_rate) +
             k.R * (U * u.p_rate);
    case kW:
      return k.w + spin;
    default:
      return k.wp + k.w.cross(spin) + k.R * (V * u.p_rate);
  }
}

}  // namespace

void ModalJointSet::output(const EvalContext& context, int i, OutputRow& row) const {
  const Slot& s = slots_[i];
  const ModalBody& b = *s.joint.body;
  const ModalUnknowns u = unknowns(context, i);
  char text[48];
  for (int j = 0; j < b.modes; ++j) {
    std::snprintf(text, sizeof text, "%8d.%d", s.info.label, b.mode_numbers[j]);
    row.begin_text(OutputFile::mod, text);
    row.scalar("q", "", u.q(j));
    row.scalar("qP", "1/s", u.p(j));
    row.scalar("qPP", "1/s^2", u.p_rate(j));
    row.end();
  }
  for (std::size_t n = 0; n < s.joint.interfaces.size(); ++n) {
    const ModalInterface& interface = s.joint.interfaces[n];
    if (!interface.output) continue;
    std::snprintf(text, sizeof text, "%8d@%d", s.info.label,
                  context.model->structural[interface.node].label);
    row.begin_text(OutputFile::mod, text);
    row.vec3("F", "N", u.force(static_cast<int>(n)));
    row.vec3("m", "N m", u.couple(static_cast<int>(n)));
    row.end();
  }
}

std::string ModalJointSet::log_line(const Model& model, int i) const {
  const ModalJoint& j = slots_[i].joint;
  const ModalBody& b = *j.body;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Vec3 center = b.m > 0 ? Vec3(b.S0 / b.m) : Vec3(nan, nan, nan);
  return "modal:" +
         log_integers({slots_[i].info.label, j.node >= 0 ? model.structural[j.node].label : -1}) +
         log_values({b.m}) + log_vector(center) + log_matrix(b.J0);
}

int ModalJointSet::private_datum(int i, std::string_view name) const {
  const ModalBody& b = *slots_[i].joint.body;
  const std::size_t open = name.find('[');
  if (open == std::string_view::npos || name.back() != ']') return -1;
  const std::string_view kind = name.substr(0, open),
                         argument = without_spaces(name.substr(open + 1, name.size() - open - 2));
  for (int what = 0; what < kDatumCount; ++what) {
    if (kind != kDatumNames[what].name) continue;
    const int index = what <= kQPP ? mode_index(b, argument) : node_component(b, argument);
    return index < 0 ? -1 : index * kDatumCount + what;
  }
  return -1;
}

std::vector<Datum> ModalJointSet::private_data(int i) const {
  const ModalJoint& j = slots_[i].joint;
  std::vector<Datum> data;
  const auto add = [&](int what, const std::string& index) {
    data.push_back(
        {std::string(kDatumNames[what].name) + "[" + index + "]", kDatumNames[what].unit});
  };
  for (int what = kQ; what <= kQPP; ++what)
    for (const int mode : j.body->mode_numbers) add(what, std::to_string(mode));
  for (const ModalInterface& interface : j.interfaces)
    for (int what = kX; what < kDatumCount; ++what)
      for (int c = 1; c <= 3; ++c)
        add(what, j.body->labels[interface.fem_node] + "," + std::to_string(c));
  return data;
}

double ModalJointSet::private_value(const EvalContext& context, int i, int datum) const {
  const int what = datum % kDatumCount, index = datum / kDatumCount;
  const ModalUnknowns u = unknowns(context, i);
  if (what == kQ) return u.q(index);
  if (what == kQP) return u.p(index);
  if (what == kQPP) return u.p_rate(index);
  return node_datum(*slots_[i].joint.body, floating_frame(context, i), u, index / 3,
                    what)(index % 3);
}

void ModalJointSet::add_inertia(const EvalContext& context, int i, int node,
                                Inertia& inertia) const {
  const Slot& s = slots_[i];
  if (node != s.joint.node || node < 0) return;
  const ModalUnknowns u = unknowns(context, i);
  const Mat3 R = context.model->node_state(context, node).R;
  inertia.m += s.joint.body->m;
  inertia.S += R * s.joint.body->first_moment(u.q);
  inertia.J += R * s.joint.body->second_moment(u.q) * R.transpose();
}

}  // namespace mbcosim
