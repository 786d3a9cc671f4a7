#include "solver/state_space.h"

#include "solver/shifted_pencil.h"

namespace mbcosim {

namespace {

constexpr double kRateTolerance =
    1e-9;  ///< dependence on the rates of inputs, relative to that on the inputs

Error state_space_error(ErrorKind kind, std::string message) {
  Error e;
  e.kind = kind;
  e.reason = "LINEARIZATION_FAILED";
  e.message = "linearization: " + std::move(message);
  return e;
}

MatX final_range(MatX t) { return restrict_to_final_range(t); }

}  // namespace

Result<StateSpace> state_space(const Linearization& system, const InputsOutputs& io) {
  // With T = (A − σE)⁻¹ E and b = (A − σE)⁻¹ B: T ẋ = (1 + σT) x + b u. The space splits into the
  // range of Tᵏ, on which T is regular, and its kernel, on which T is nilpotent: there x = −(1 +
  // σT)⁻¹ b u but for rates of u.
  constexpr double kShift = ShiftedPencil::kShift;
  const ShiftedPencil pencil(system);
  if (!pencil.is_regular())
    return state_space_error(ErrorKind::singular,
                             "the linearized system is singular: constraints are redundant or "
                             "something is undetermined");
  const MatX &t = pencil.t, b = pencil.lu.solve(io.b);
  const MatX right = final_range(t), left = final_range(t.transpose());
  const Eigen::PartialPivLU<MatX> cross_basis(left.transpose() * right);
  const MatX regular = cross_basis.solve(left.transpose() * t * right),
             b_regular = cross_basis.solve(left.transpose() * b);
  const Eigen::PartialPivLU<MatX> regular_lu(regular);
  const Eigen::Index states = right.cols();

  StateSpace result;
  result.a = regular_lu.inverse() + kShift * MatX::Identity(states, states);
  result.b = regular_lu.solve(b_regular);
  const MatX b_nilpotent = b - right * b_regular;
  const MatX nilpotent = t - right * regular * cross_basis.solve(left.transpose());
  const MatX direct =
      -(MatX::Identity(t.rows(), t.cols()) + kShift * nilpotent).partialPivLu().solve(b_nilpotent);
  result.c = io.c0 * right + io.c1 * right * result.a;
  result.d = io.d0 + io.c0 * direct + io.c1 * right * result.b;
  const MatX by_rate = io.c1 * direct + io.c0 * nilpotent * direct;
  if (by_rate.size() > 0 &&
      by_rate.cwiseAbs().maxCoeff() > kRateTolerance * (1 + result.d.cwiseAbs().maxCoeff()))
    return state_space_error(
        ErrorKind::argument,
        "an output depends on the rate of an input: constraints pass it on directly");
  return result;
}

}  // namespace mbcosim
