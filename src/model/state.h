/// Everything that a step changes, as plain contiguous arrays: one copy per array makes a snapshot.
#pragma once

#include <cstdint>
#include <vector>

#include "math/thread_team.h"
#include "math/types.h"
#include "model/step_control.h"

namespace mbcosim {

/// Orientation and angular velocity of one structural node. Plain arrays (column-major), so that a
/// State is plain data.
struct NodeRotation {
  Mat3 R;  ///< current orientation, node frame -> global
  Vec3 w;  ///< current angular velocity, global [rad/s]
};

/// What the current ones follow from, apart from them: assembly reads only those.
struct NodeRotationHistory {
  Mat3 R_ref;  ///< reference (predicted) orientation of this step; R = R(g) R_ref
  Mat3 R1;     ///< at the last accepted step
  Mat3 R2;     ///< one step earlier
  Vec3 w_ref, w1, w2;

  NodeRotationHistory() = default;
  /// A node that has not moved yet.
  explicit NodeRotationHistory(const NodeRotation& q)
      : R_ref(q.R), R1(q.R), R2(q.R), w_ref(q.w), w1(q.w), w2(q.w) {}
};

/// Three consecutive entries of a vector of unknowns or rates, from entry `i`.
inline Vec3 vector_at(const std::vector<double>& y, int i) { return {y[i], y[i + 1], y[i + 2]}; }

struct State {
  double time =
      0;  ///< time of the last accepted step, or of the step's end while it is being solved [s]
  double h = 0;           ///< length of the last (or current) step [s]
  double h_previous = 0;  ///< length of the step before [s]
  std::int64_t step = 0;  ///< number of the last (or current) step; 0: initial solution

  std::vector<double> y,
      yp;  ///< unknowns and rates (n); algebraic unknowns keep a running integral in yp
  std::vector<double> y1, yp1;                        ///< at the last accepted step (n)
  std::vector<double> y2, yp2;                        ///< one step earlier (n)
  std::vector<NodeRotation> rotation;                 ///< (structural nodes)
  std::vector<NodeRotationHistory> rotation_history;  ///< (structural nodes)
  std::vector<double> memory;                         ///< what elements, laws and drives remember
  std::vector<double> variables;  ///< variables of the deck that run-time strings read or assign
  StepControl control;
  std::vector<double> kept_matrix;  ///< values of the matrix that `keep jacobian matrix` keeps
  /// Loads that external codes apply to structural nodes: force [N] and moment about the node
  /// [N·m], global components (6 × structural nodes), or empty when there are none.
  std::vector<double> external_loads;
};

/// The arrays of numbers; rotations are not among them.
inline constexpr std::vector<double> State::*kStateArrays[] = {
    &State::y,   &State::yp,     &State::y1,        &State::yp1,         &State::y2,
    &State::yp2, &State::memory, &State::variables, &State::kept_matrix, &State::external_loads};

/// to = from; the threads of a team, if there is one, share the work.
void copy_state(const State& from, State& to, ThreadTeam* team);

}  // namespace mbcosim
