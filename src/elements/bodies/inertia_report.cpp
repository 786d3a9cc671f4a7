#include "elements/bodies/inertia_report.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "elements/log_text.h"

namespace mbcosim {

void MassProperties::add(const Inertia& i, const NodeState& node) {
  const Mat3 xx = cross<double>(node.x), sx = cross<double>(i.S);
  const Vec3 b = i.m * node.v + node.w.cross(i.S) + i.b;
  m += i.m;
  S += i.m * node.x + i.S;
  J += i.J - sx * xx - xx * sx - i.m * xx * xx;
  B += b;
  G += i.J * node.w + i.S.cross(node.v) + i.g + node.x.cross(b);
}

Vec3 MassProperties::angular_velocity() const {
  const Mat3 j = central_inertia();
  const Eigen::FullPivLU<Mat3> lu(j);
  return lu.isInvertible() ? Vec3(lu.solve(G - centre().cross(B))) : Vec3::Zero();
}

Mat3 MassProperties::inertia_about(const Vec3& x) const {
  const Mat3 d = cross<double>(centre() - x);
  return central_inertia() - m * d * d;
}

MassProperties mass_properties(const EvalContext& context,
                               const std::vector<ElementRef>& elements) {
  MassProperties total;
  for (const ElementRef& e : elements)
    for (const int node : e.set->nodes(e.index)) {
      Inertia inertia;
      e.set->add_inertia(context, e.index, node, inertia);
      total.add(inertia, context.model->node_state(context, node));
    }
  return total;
}

PrincipalInertia principal_inertia(const Mat3& j) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(0.5 * (j + j.transpose()));
  PrincipalInertia r{solver.eigenvalues(), solver.eigenvectors()};
  if (r.axes.determinant() < 0) r.axes.col(2) = -r.axes.col(2);
  return r;
}

namespace {

/// Private data in order: X, V, Omega (3 each), J, JP (9 each, by rows), m.
enum DatumIndex { kX = 0, kV = 3, kOmega = 6, kJ = 9, kJP = 18, kMass = 27, kData };

}  // namespace

std::vector<Datum> InertiaReport::private_data() const {
  std::vector<Datum> data;
  for (const DatumName& d :
       std::array<DatumName, 3>{{{"X", "m"}, {"V", "m/s"}, {"Omega", "rad/s"}}})
    for (int i = 1; i <= 3; ++i)
      data.push_back({std::string(d.name) + "[" + std::to_string(i) + "]", d.unit});
  for (const char* word : {"J", "JP"})
    for (int i = 1; i <= 3; ++i)
      for (int j = 1; j <= 3; ++j)
        data.push_back({std::string(word) + "[" + std::to_string(i) + "," + std::to_string(j) + "]",
                        "kg m^2"});
  data.push_back({"m", "kg"});
  return data;
}

int InertiaReport::private_datum(std::string_view name) const {
  return index_of(private_data(), name);
}

double InertiaReport::private_value(const GeneralView& u, int datum) const {
  const MassProperties p = mass_properties(u.context, elements_);
  if (datum == kMass) return p.m;
  if (datum < kV) return p.centre()(datum - kX);
  if (datum < kOmega) return p.velocity()(datum - kV);
  if (datum < kJ) return p.angular_velocity()(datum - kOmega);
  const Mat3 j = p.central_inertia();
  if (datum < kJP) return j((datum - kJ) / 3, (datum - kJ) % 3);
  const PrincipalInertia principal = principal_inertia(j);
  const int row = (datum - kJP) / 3, column = (datum - kJP) % 3;
  return row == column ? principal.moments(row) : 0.0;
}

std::string InertiaReport::text(const EvalContext& context, int label,
                                const std::string& name) const {
  const MassProperties p = mass_properties(context, elements_);
  const Mat3 about = p.inertia_about(x_);
  const PrincipalInertia principal = principal_inertia(p.central_inertia());
  const Vec3 offset = p.centre() - x_;
  std::string s = "inertia: " + std::to_string(label) + " \"" + name + "\"";
  const auto line = [&](const char* tag, const std::string& values) {
    s += std::string("\n    ") + tag + values;
  };
  line("mass:", log_values({p.m}));
  line("J:", log_matrix(p.J));
  line("Xcg:", log_vector(p.centre()));
  line("Jcg:", log_matrix(p.central_inertia()));
  line("Vcg:", log_vector(p.velocity()));
  line("Wcg:", log_vector(p.angular_velocity()));
  line("Xcg-X:", log_vector(offset));
  line("R^T*(Xcg-X):", log_vector(R_.transpose() * offset));
  line("J(X):", log_matrix(about));
  line("R^T*J(X)*R:", log_matrix(R_.transpose() * about * R_));
  line("Rp:", log_matrix(principal.axes));
  line("Thetap:", log_vector(vector_of_rotation(principal.axes)));
  line("Jp:", log_vector(principal.moments));
  return s;
}

}  // namespace mbcosim
