/// Private data of structural nodes (MBDyn input manual, "structural node", private data).
#include <algorithm>
#include <array>

#include "model/inverse_problem.h"

namespace mbcosim {

namespace {

/// In the order of the manual, whose numbers `index` counts.
enum Group {
  kX,
  kx,
  kPhi,
  kXP,
  kxP,
  kOmega,
  komega,
  kE,
  kE313,
  kE321,
  kPE,
  kXPP,
  kxPP,
  kOmegaP,
  komegaP,
  kGroups
};
constexpr std::array<const char*, kGroups> kNames = {"X",     "x",     "Phi", "XP",     "xP",
                                                     "Omega", "omega", "E",   "E313",   "E321",
                                                     "PE",    "XPP",   "xPP", "OmegaP", "omegaP"};
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
  // zero.
  if (context.phase == Phase::derivatives) return Vec3::Zero();
  const NodeAcceleration a = model.node_acceleration(context, node);
  const Vec3 global = group == kXPP || group == kxPP ? a.a : a.wp;
  return group == kxPP || group == komegaP ? Vec3(s.R.transpose() * global) : global;
}

/// Of the two quadruples that describe a rotation, that in which the largest is positive.
std::array<double, 4> euler_parameters(const Vec3& phi) {
  const double half = phi.norm() / 2, scale = half > 0 ? std::sin(half) / (2 * half) : 0.5;
  std::array<double, 4> e = {std::cos(half), scale * phi(0), scale * phi(1), scale * phi(2)};
  const double largest = *std::max_element(
      e.begin(), e.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (largest < 0)
    for (double& x : e) x = -x;
  return e;
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
  return euler_parameters(vector_datum(*this, context, node, kPhi))[i];
}

std::optional<NodeDof> Model::dof_of_structural_datum(int node, int datum) {
  const int group = datum / kSlots, i = datum % kSlots;
  if (group == kX) return NodeDof{.structural = true, .node = node, .component = i, .order = 0};
  if (group == kXP) return NodeDof{.structural = true, .node = node, .component = i, .order = 1};
  if (group == kOmega)
    return NodeDof{.structural = true, .node = node, .component = 3 + i, .order = 1};
  return std::nullopt;
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
