/// Private data of structural nodes (MBDyn input manual, "structural node", private data).
#include <array>

#include "model/inverse_problem.h"

namespace mbcosim {

namespace {

enum Group {
  kX,
  kXP,
  kOmega,
  kx,
  kxP,
  komega,
  kPhi,
  kE,
  kE313,
  kE321,
  kPE,
  kXPP,
  kOmegaP,
  kxPP,
  komegaP,
  kGroups
};
constexpr std::array<const char*, kGroups> kNames = {"X",     "XP",  "Omega",  "x",    "xP",
                                                     "omega", "Phi", "E",      "E313", "E321",
                                                     "PE",    "XPP", "OmegaP", "xPP",  "omegaP"};
constexpr int kSlots = 4;  ///< datum = group·kSlots + component

bool needs_acceleration(int group) { return group >= kXPP; }

Vec3 vector_datum(const Model& model, const EvalContext& context, int node, int group) {
  const NodeState s = model.node_state(context, node);
  switch (group) {
    case kX:
      return s.x;
    case kXP:
      return s.v;
    case kOmega:
      return s.w;
    case kx:
      return s.R.transpose() * s.x;
    case kxP:
      return s.R.transpose() * s.v;
    case komega:
      return s.R.transpose() * s.w;
    case kPhi:
      return vector_of_rotation(s.R);
    case kE:
      return euler123_of_rotation(s.R);
    case kE313:
      return euler313_of_rotation(s.R);
    case kE321:
      return euler321_of_rotation(s.R);
    default:
      break;
  }
  // Unknown to the derivatives phase until it is over: as drive arguments accelerations start from
  // zero. As in MBDyn those of dummy nodes do so in record 0, too.
  const bool dummy_at_start = model.structural[node].is_dummy() && context.state->step == 0;
  if (context.phase == Phase::derivatives || dummy_at_start) return Vec3::Zero();
  const NodeAcceleration a = model.node_acceleration(context, node);
  const Vec3 global = group == kXPP || group == kxPP ? a.a : a.wp;
  return group == kxPP || group == komegaP ? Vec3(s.R.transpose() * global) : global;
}

}  // namespace

int Model::structural_datum(int node, std::string_view name) const {
  const std::size_t open = name.find('[');
  if (open == std::string_view::npos || name.size() != open + 3 || name.back() != ']') return -1;
  std::string_view word = name.substr(0, open);
  if (word == "E123") word = "E";
  const int index = name[open + 1] - '0';
  for (int g = 0; g < kGroups; ++g) {
    if (word != kNames[g]) continue;
    const StructuralNode& n = structural[node];
    if (needs_acceleration(g) && !n.has_momentum() && n.kind != StructuralKind::modal &&
        !n.is_dummy() && !inverse_problem(*this))
      return -1;
    if (g == kPE) return index >= 0 && index <= 3 ? g * kSlots + index : -1;
    return index >= 1 && index <= 3 ? g * kSlots + index - 1 : -1;
  }
  return -1;
}

double Model::structural_datum_value(const EvalContext& context, int node, int datum) const {
  const int group = datum / kSlots, i = datum % kSlots;
  if (group != kPE) return vector_datum(*this, context, node, group)(i);
  const Vec3 phi = vector_datum(*this, context, node, kPhi);
  const double angle = phi.norm();
  if (i == 0) return std::cos(angle / 2);
  return angle > 0 ? std::sin(angle / 2) * phi(i - 1) / angle : 0.0;
}

std::vector<std::string> Model::structural_data_names(const StructuralNode& node) {
  std::vector<std::string> names;
  const bool accelerations =
      node.has_momentum() || node.kind == StructuralKind::modal || node.is_dummy();
  for (int g = 0; g < kGroups; ++g) {
    if (needs_acceleration(g) && !accelerations) continue;
    for (int i = g == kPE ? 0 : 1; i <= 3; ++i)
      names.push_back(std::string(kNames[g]) + "[" + std::to_string(i) + "]");
  }
  return names;
}

}  // namespace mbcosim
