#include "model/node_momenta.h"

namespace mbcosim {

namespace {

/// β and γ about the node in global axes, their rates, the kinetic energy ½ (β·v + γ·ω).
constexpr std::array<DatumName, 13> kData{{{"beta[1]", "kg m/s"},
                                           {"beta[2]", "kg m/s"},
                                           {"beta[3]", "kg m/s"},
                                           {"gamma[1]", "kg m^2/s"},
                                           {"gamma[2]", "kg m^2/s"},
                                           {"gamma[3]", "kg m^2/s"},
                                           {"betaP[1]", "N"},
                                           {"betaP[2]", "N"},
                                           {"betaP[3]", "N"},
                                           {"gammaP[1]", "N m"},
                                           {"gammaP[2]", "N m"},
                                           {"gammaP[3]", "N m"},
                                           {"KE", "J"}}};
constexpr int kEnergy = 12;

}  // namespace

void NodeMomenta::add(const StructuralNode& node, int index) {
  ElementInfo info;
  info.family = Family::automatic_structural;
  info.label = node.label;
  info.where = node.where;
  nodes_.push_back(index);
  info_.push_back(std::move(info));
}

int NodeMomenta::private_datum(int, std::string_view name) const { return index_of(kData, name); }

std::vector<Datum> NodeMomenta::private_data(int) const { return data_of(kData); }

double NodeMomenta::private_value(const EvalContext& context, int i, int datum) const {
  if (context.phase == Phase::input) return 0;  // there are no unknowns yet
  const StructuralNode& node = context.model->structural[nodes_[i]];
  const int first = node.first + node.position_unknowns(), count = node.has_rotation() ? 6 : 3;
  const double *y = &context.state->y[first], *yp = &context.state->yp[first];
  if (datum == kEnergy) {
    const NodeState s = context.model->node_state(context, nodes_[i]);
    double twice = 0;
    for (int k = 0; k < count; ++k) twice += y[k] * (k < 3 ? s.v(k) : s.w(k - 3));
    return twice / 2;
  }
  const int k = datum % 6;
  return k >= count ? 0.0 : datum < 6 ? y[k] : yp[k];
}

}  // namespace mbcosim
