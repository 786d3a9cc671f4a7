/// Mass properties of a set of elements: the `inertia` card. MBDyn input manual, "Inertia".
#pragma once

#include <string>
#include <vector>

#include "elements/general_element.h"

namespace mbcosim {

/// Rigid-body properties of a set of elements in global axes.
///
///   X = S/m,  J_cg = J + S× X×,  V = B/m,  Ω = J_cg⁻¹ (G − X × B)
///
/// with S, J, the momentum B and the momenta moment G about the global origin.
struct MassProperties {
  double m = 0;           ///< [kg]
  Vec3 S = Vec3::Zero();  ///< [kg·m]
  Mat3 J = Mat3::Zero();  ///< [kg·m²]
  Vec3 B = Vec3::Zero();  ///< [kg·m/s]
  Vec3 G = Vec3::Zero();  ///< [kg·m²/s]

  /// Adds inertia about a node that moves with `node`.
  void add(const Inertia& inertia, const NodeState& node);
  Vec3 centre() const { return m != 0 ? Vec3(S / m) : Vec3::Zero(); }
  Vec3 velocity() const { return m != 0 ? Vec3(B / m) : Vec3::Zero(); }
  Mat3 central_inertia() const { return J + cross<double>(S) * cross<double>(centre()); }
  Vec3 angular_velocity() const;  ///< zero when J_cg is singular
  /// Inertia about a point.
  Mat3 inertia_about(const Vec3& x) const;
};

MassProperties mass_properties(const EvalContext& context, const std::vector<ElementRef>& elements);

/// Principal moments and axes (columns, right-handed).
struct PrincipalInertia {
  Vec3 moments;  ///< [kg·m²]
  Mat3 axes;
};
PrincipalInertia principal_inertia(const Mat3& j);

/// `inertia, …, output, always`: the properties at any time, as private data. Without rows of its
/// own.
class InertiaReport : public GeneralElement {
 public:
  InertiaReport(std::vector<ElementRef> elements, const Vec3& x, const Mat3& R)
      : elements_(std::move(elements)), x_(x), R_(R) {}
  void connect(GeneralConnection&) override {}
  void residual(const GeneralView&, GeneralResidual&) const override {}
  void jacobian(const GeneralView&, GeneralJacobian&) const override {}
  int private_datum(std::string_view name) const override;
  std::vector<Datum> private_data() const override;
  double private_value(const GeneralView& u, int datum) const override;

  /// The block of .log: label, name and the properties.
  std::string text(const EvalContext& context, int label, const std::string& name) const;

 private:
  std::vector<ElementRef> elements_;
  Vec3 x_;  ///< point of the report, global [m]
  Mat3 R_;  ///< axes of the report
};

}  // namespace mbcosim
