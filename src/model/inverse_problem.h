/// What a deck with `problem: inverse dynamics` says beyond other decks: a ModelPart.
#pragma once

#include <map>

#include "model/model_part.h"

namespace mbcosim {

/// Stages of inverse dynamics in which an element takes part (`inverse dynamics`, at the end of its
/// card).
struct InverseRole {
  bool torque = false;      ///< its multipliers are unknowns of the force stage
  bool prescribed = false;  ///< its constraints hold in the stages of the motion
  bool ergonomy = false;    ///< its elastic energy is made small in the position stage
  bool loads = false;       ///< it loads the nodes in the force stage
};

/// Times, tolerances and limits stand in InitialValueSettings.
struct InverseProblem {
  bool underdetermined =
      false;  ///< `underdetermined fully actuated`; else fully actuated collocated
  /// Of the position, velocity and acceleration stages: that of the change since the last record,
  /// and that of the bodies' inertia.
  double change_weight[3] = {1, 1, 1}, inertia_weight[3] = {0, 0, 0};
  bool full_residual_test = false;
  int memory = -1;       ///< accelerations in State::memory (6 × structural nodes)
  int multipliers = -1;  ///< sums of the multipliers of position stages there (rows of joints)
  std::map<int, InverseRole> roles;  ///< by ElementInfo::order

  InverseRole role(const ElementInfo& info) const {
    const auto found = roles.find(info.order);
    return found == roles.end() ? InverseRole{} : found->second;
  }
};

/// Null unless the model is one of inverse dynamics.
inline const InverseProblem* inverse_problem(const Model& model) {
  return find_part<InverseProblem>(model);
}

}  // namespace mbcosim
