/// What Newton's method solves: r(z) = 0, whatever z is made of. One instant: solver/instant.h; the
/// two instants of the third-order method: solver/third_order.h.
#pragma once

#include <vector>

#include "model/sparse_pattern.h"
#include "model/state.h"
#include "solver/workspace.h"

namespace mbcosim {

struct NewtonSettings;

/// An iterate z (m) with its residual and matrix. Corrections δ (m) are those of the rates of
/// differential unknowns and of the values of algebraic ones.
class NewtonSystem {
 public:
  virtual ~NewtonSystem() = default;

  /// Vectors and matrix of the iteration, (m) and in the system's pattern.
  virtual NewtonScratch& scratch() = 0;
  /// The part of the iterate at the end of the step, which external codes see; its `control` keeps
  /// a matrix from one step to the next.
  virtual State& state() = 0;

  virtual void compute_residual() = 0;
  /// The test value of the last residual.
  virtual double error(const NewtonSettings& settings) const = 0;
  /// Is the last residual beyond `max residual`?
  virtual bool exceeds_limits(const NewtonSettings& settings) const = 0;

  /// J = −∂r/∂δ at the iterate.
  virtual void compute_matrix() = 0;
  /// Factors the matrix in `scratch`, with derivatives of external loads at the iterate.
  virtual bool factor() = 0;
  virtual void solve(double* rhs) = 0;
  /// After a matrix that cannot be factored: the unknown of the model without a pivot, or -1.
  virtual int singular_column() const = 0;
  /// Gradient of ½ rᵀr along unknown i, with the sign of Jᵀr.
  virtual double gradient(int i) const = 0;

  /// Adds δ to the iterate.
  virtual void correct(const std::vector<double>& delta) = 0;
  /// Remembers the iterate, and goes back to the one remembered.
  virtual void mark() = 0;
  virtual void go_back() = 0;

  virtual bool is_differential(int i) const = 0;
  /// max(|z|, |ż|, 1) of unknown i.
  virtual double magnitude(int i) const = 0;
  /// Σ z² + Σ ż².
  virtual double square() const = 0;

  /// What the matrix depends on besides the iterate: one that is kept serves while they stay.
  struct Coefficients {
    double first, second;
    bool operator==(const Coefficients&) const = default;
  };
  virtual Coefficients coefficients() const = 0;
};

}  // namespace mbcosim
