#include "elements/bodies/body.h"

#include "elements/log_text.h"

namespace mbcosim {

template void Body::residual(const Local<double>&, Residual<double>&) const;

void Body::tangent(const Local<double>& u, Tangent& t) const {
  const Vec3 S = u.R(0) * S0;
  const Mat3 J = u.R(0) * J0 * u.R(0).transpose();
  const Vec3 w = u.w(0);
  const Mat3 Sx = cross<double>(S), wx = cross<double>(w), vx = cross<double>(u.v(0));
  const int b = t.row_momentum(0), g = b + 3;
  t.add_velocity(b, 0, -m * Mat3::Identity());
  t.add_rotation(b, 0, wx * Sx, Sx);
  t.add_velocity(g, 0, -Sx);
  t.add_rotation(g, 0, cross<double>(J * w) - J * wx - vx * Sx, -J);
  if (!u.model().gravity) return;
  const Vec3 a = u.model().gravity_at(*u.context, u.x(0));
  t.add_orientation(t.row_node(0) + 3, 0, cross<double>(a) * Sx);
  if (u.model().gravity->uniform) return;
  const Mat3 da = u.model().gravity_gradient(*u.context, u.x(0));
  t.add_position(t.row_node(0), 0, m * da);
  t.add_position(t.row_node(0) + 3, 0, Sx * da);
}

void Body::add_inertia(const Local<double>& u, int node_index, Inertia& inertia) const {
  if (node_index == node) add_to(inertia, u.R(0));
}

void Body::add_to(Inertia& inertia, const Mat3& R) const {
  inertia.m += m;
  inertia.S += R * S0;
  inertia.J += R * J0 * R.transpose();
}

std::string Body::log(const Model& model, int label) const {
  return "body:" + log_integers({label, model.structural[node].label}) + log_values({m}) +
         log_vector(centre) + log_matrix(J0);
}

int Body::private_datum(std::string_view name) {
  return name == "E" ? 0 : name == "V" ? 1 : name == "m" ? 2 : -1;
}

double Body::private_value(const Local<double>& u, int datum) const {
  return value(*u.context, {u.x(0), u.R(0), u.v(0), u.w(0)}, datum);
}

double Body::value(const EvalContext& context, const NodeState& n, int datum) const {
  const Vec3 S = n.R * S0;
  if (datum == 2) return m;
  if (datum == 0) {
    const Vec3 wl = n.R.transpose() * n.w;
    return 0.5 * m * n.v.squaredNorm() + n.v.dot(n.w.cross(S)) + 0.5 * wl.dot(J0 * wl);
  }
  return -context.model->gravity_at(context, n.x).dot(m * n.x + S);
}

void PointMass::tangent(const Local<double>& u, Tangent& t) const {
  t.add_velocity(t.row_momentum(0), 0, -m * Mat3::Identity());
  if (u.model().gravity)
    t.add_position(t.row_node(0), 0, m * u.model().gravity_gradient(*u.context, u.x(0)));
}

void PointMass::add_inertia(const Local<double>&, int node_index, Inertia& inertia) const {
  if (node_index == node) inertia.m += m;
}

std::string PointMass::log(const Model& model, int label) const {
  return "body:" + log_integers({label, model.structural[node].label}) + log_values({m}) +
         log_vector(Vec3::Zero()) + log_matrix(Mat3::Zero());
}

double PointMass::private_value(const Local<double>& u, int datum) const {
  if (datum == 2) return m;
  if (datum == 0) return 0.5 * m * u.v(0).squaredNorm();
  return -m * u.model().gravity_at(*u.context, u.x(0)).dot(u.x(0));
}

}  // namespace mbcosim
