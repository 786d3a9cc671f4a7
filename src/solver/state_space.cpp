#include "solver/state_space.h"

#include <cmath>

#include "solver/lapack.h"
#include "solver/shifted_pencil.h"
#include "solver/stoppable.h"

namespace mbcosim {

namespace {

constexpr double kRateTolerance =
    1e-9;  ///< dependence on the rates of inputs, relative to that on the inputs

Error state_space_error(ErrorKind kind, const std::string& message) {
  return make_error(kind, "LINEARIZATION_FAILED", "linearization: " + message);
}

MatX final_range(MatX t, const Watch& watch) { return restrict_to_final_range(t, watch); }

/// T ẋ = (1 + σT) x + b u with the ranges of Tᵏ and (Tᵀ)ᵏ.
struct Split {
  MatX t, b, right, left;
  VecX scale;  ///< x = scale · (x of this system), by rows

  bool is_consistent() const { return left.cols() == right.cols(); }
};

/// Powers of two that make rows and columns of S⁻¹ T S alike in size (Parlett and Reinsch,
/// Numerische Mathematik 13, 1969).
VecX balancing_scale(MatX t, const Watch& watch) {
  constexpr int kSweeps = 20;
  constexpr double kGain = 0.95;
  VecX scale = VecX::Ones(t.rows());
  bool changed = true;
  for (int sweep = 0; sweep < kSweeps && changed; ++sweep) {
    changed = false;
    watch.look();
    for (Eigen::Index i = 0; i < t.rows(); ++i) {
      const double own = std::abs(t(i, i));
      const double column = t.col(i).lpNorm<1>() - own, row = t.row(i).lpNorm<1>() - own;
      if (!(column > 0) || !(row > 0)) continue;
      const double f = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (f == 1 || column * f + row / f > kGain * (column + row)) continue;
      t.col(i) *= f;
      t.row(i) /= f;
      scale(i) *= f;
      changed = true;
    }
  }
  return scale;
}

/// Decisions about the rank depend on the units of the unknowns. Where they contradict each other
/// (the ranges of Tᵏ and its transpose have the same dimension) they are taken again in balanced
/// units.
Split split(const MatX& t, const MatX& b, const Watch& watch) {
  Split plain{t, b, final_range(t, watch), final_range(t.transpose(), watch), VecX::Ones(t.rows())};
  if (plain.is_consistent()) return plain;
  const VecX s = balancing_scale(t, watch), inverse = s.cwiseInverse();
  const MatX balanced = inverse.asDiagonal() * t * s.asDiagonal();
  return {balanced, inverse.asDiagonal() * b, final_range(balanced, watch),
          final_range(balanced.transpose(), watch), s};
}

// With T = (A − σE)⁻¹ E and b = (A − σE)⁻¹ B: T ẋ = (1 + σT) x + b u. The space splits into the
// range of Tᵏ, on which T is regular, and its kernel, on which T is nilpotent: there x = −(1 +
// σT)⁻¹ b u but for rates of u.
Result<StateSpace> eliminate(const Linearization& system, const InputsOutputs& io,
                             const Watch& watch) {
  if (const auto lapack = Lapack::get(); !lapack) return lapack.error();
  constexpr double kShift = ShiftedPencil::kShift;
  ShiftedPencil pencil(system, watch);
  if (!pencil.is_regular())
    return state_space_error(ErrorKind::singular,
                             "the linearized system is singular: constraints are redundant or "
                             "something is undetermined");
  const Split parts = split(pencil.t, pencil.solve(io.b, watch), watch);
  if (!parts.is_consistent())
    return state_space_error(
        ErrorKind::singular,
        "the number of states cannot be told (" + std::to_string(parts.right.cols()) + " or " +
            std::to_string(parts.left.cols()) +
            "): the unknowns differ too much in size; the descriptor form needs no such decision");
  const MatX &t = parts.t, &b = parts.b, &right = parts.right, &left = parts.left;
  const MatX c0 = io.c0 * parts.scale.asDiagonal(), c1 = io.c1 * parts.scale.asDiagonal();
  const Eigen::PartialPivLU<MatX> cross_basis(transposed_product(left, right, watch));
  const MatX projected =
      solve(cross_basis, left.transpose(), watch);  // on the range, along the kernel
  const MatX regular = product(projected, product(t, right, watch), watch),
             b_regular = projected * b;
  const Eigen::PartialPivLU<MatX> regular_lu(regular);
  const Eigen::Index states = right.cols();

  StateSpace result;
  result.a = solve(regular_lu, MatX::Identity(states, states), watch) +
             kShift * MatX::Identity(states, states);
  result.b = solve(regular_lu, b_regular, watch);
  const MatX b_nilpotent = b - right * b_regular;
  const MatX nilpotent = t - product(product(right, regular, watch), projected, watch);
  const Eigen::PartialPivLU<MatX> shifted_lu(MatX::Identity(t.rows(), t.cols()) +
                                             kShift * nilpotent);
  const MatX direct = -solve(shifted_lu, b_nilpotent, watch);
  result.c = c0 * right + c1 * right * result.a;
  result.d = io.d0 + c0 * direct + c1 * right * result.b;
  const MatX by_rate = c1 * direct + c0 * nilpotent * direct;
  if (by_rate.size() > 0 &&
      by_rate.cwiseAbs().maxCoeff() > kRateTolerance * (1 + result.d.cwiseAbs().maxCoeff()))
    return state_space_error(
        ErrorKind::argument,
        "an output depends on the rate of an input: constraints pass it on directly");
  return result;
}

}  // namespace

Result<StateSpace> state_space(const Linearization& system, const InputsOutputs& io,
                               const CancelToken* cancel) {
  try {
    return eliminate(system, io, Watch(cancel));
  } catch (const Stopped&) {
    return state_space_error(ErrorKind::cancelled, "stopped");
  }
}

Result<StateSpace> state_space(const Linearization& system, const InputsOutputs& io) {
  return state_space(system, io, nullptr);
}

}  // namespace mbcosim
