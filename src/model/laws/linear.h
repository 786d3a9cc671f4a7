/// Linear constitutive laws.
#pragma once

#include "model/laws/law_parts.h"

namespace mbcosim {

/// f = σ₀ + a(t) K e + b(t) C ε̇ with e = ε − ε₀(t) (MBDyn input manual, "linear elastic" to "linear
/// time variant viscoelastic generic"). Without drives a = b = 1.
template <int N>
class LinearLaw : public Law<N> {
 public:
  using typename Law<N>::V;
  using typename Law<N>::M;
  using typename Law<N>::Response;

  LinearLaw(LawType type, M stiffness, M damping, Prestress<N> pre, DrivePtr a = nullptr,
            DrivePtr b = nullptr)
      : type_(type),
        stiffness_(stiffness),
        damping_(damping),
        pre_(std::move(pre)),
        a_(std::move(a)),
        b_(std::move(b)) {}
  LawType type() const override { return type_; }
  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               Response& r) const override;

 private:
  LawType type_;
  M stiffness_, damping_;
  Prestress<N> pre_;
  DrivePtr a_, b_;
};

/// A 6D linear law whose torsional stiffness grows with the axial strain: K₄₄ + c ε₁ (ε₁ without
/// the prestrain subtracted).
class AxialTorsionLaw : public Law<6> {
 public:
  AxialTorsionLaw(LawType type, Mat6 stiffness, Mat6 damping, double coupling, Prestress<6> pre)
      : type_(type),
        stiffness_(stiffness),
        damping_(damping),
        coupling_(coupling),
        pre_(std::move(pre)) {}
  LawType type() const override { return type_; }
  void respond(const EvalContext& context, const Vec6& strain, const Vec6& rate, bool tangent,
               Response& r) const override;

 private:
  LawType type_;
  Mat6 stiffness_, damping_;
  double coupling_;  ///< c
  Prestress<6> pre_;
};

}  // namespace mbcosim
