/// Constitutive laws (MBDyn input manual) in 1, 3 and 6 dimensions: (strain, rate) -> force.
#pragma once

#include "math/dual.h"
#include "math/types.h"
#include "model/fwd.h"

namespace mbcosim {

enum class LawType { elastic = 1, viscous = 2, viscoelastic = 3 };

template <int N>
class Law {
 public:
  using V = VecN<N>;
  using M = MatN<N>;
  /// Force and its exact derivatives.
  struct Response {
    V f;    ///< force (N)
    M de;   ///< ∂f/∂ε (N × N)
    M dep;  ///< ∂f/∂ε̇ (N × N)
  };

  virtual ~Law() = default;
  virtual LawType type() const = 0;
  /// `r.de` and `r.dep` must be filled when `tangent`, zero where independent.
  virtual void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
                       Response& r) const = 0;

  /// Laws with memory (bistop): called once a step after the prediction, and after convergence,
  /// with the strain then.
  virtual void after_predict(const EvalContext&, State&, const V& /*strain*/,
                             const V& /*rate*/) const {}
  virtual void after_convergence(const EvalContext&, State&, const V& /*strain*/,
                                 const V& /*rate*/) const {}
  virtual bool has_memory() const { return false; }
  /// An independent copy with its own memory, for `reference, <label>`; null when the law can be
  /// shared.
  virtual LawPtr<N> copy(ModelBuilder&) const { return nullptr; }

  /// Data a law adds to its element's output line (the shock absorber's p, A, Fe, Fv).
  virtual int output_size() const { return 0; }
  virtual void output(const EvalContext&, const V& /*strain*/, const V& /*rate*/,
                      double* /*values*/) const {}
  /// Index of a private datum ("p"), or -1: it is then `output` value number k. Laws with private
  /// data have at most 8 values.
  virtual int private_datum(const std::string& /*name*/) const { return -1; }

  /// Force for any scalar type, by the chain rule.
  template <class T>
  Eigen::Matrix<T, N, 1> force(const EvalContext& context, const Eigen::Matrix<T, N, 1>& strain,
                               const Eigen::Matrix<T, N, 1>& rate) const;
};

template <int N>
template <class T>
Eigen::Matrix<T, N, 1> Law<N>::force(const EvalContext& context,
                                     const Eigen::Matrix<T, N, 1>& strain,
                                     const Eigen::Matrix<T, N, 1>& rate) const {
  V e, ep;
  for (int i = 0; i < N; ++i) {
    e(i) = value_of(strain(i));
    ep(i) = value_of(rate(i));
  }
  Response r;
  constexpr bool plain = std::is_same_v<T, double>;
  respond(context, e, ep, !plain, r);
  Eigen::Matrix<T, N, 1> f;
  for (int i = 0; i < N; ++i) {
    f(i) = T(r.f(i));
    if constexpr (!plain) {
      for (int j = 0; j < N; ++j)
        for (int k = 0; k < T::directions; ++k)
          f(i).d[k] += r.de(i, j) * strain(j).d[k] + r.dep(i, j) * rate(j).d[k];
    }
  }
  return f;
}

}  // namespace mbcosim
