#include "elements/electric/electric.h"

namespace mbcosim {

void Accelerometer::start(Start& s) const {
  const Vec3 e = s.u.R(0) * e0;
  s.own(0) = rotational ? e.dot(s.u.w(0)) : e.dot(s.u.v(0) + s.u.w(0).cross(s.u.R(0) * f));
}

void FilteredAccelerometer::start(Start& s) const { s.own(2) = -(s.u.R(0) * e0).dot(s.u.v(0)); }

void DisplacementSensor::start(Start& s) const {
  const Local<double>& u = s.u;
  const ScalarNode& node = u.model().scalars[output_node];
  const Vec3 arm1 = u.R(k1) * f1, arm2 = u.R(k2) * f2;
  const Vec3 d = u.x(k2) + arm2 - u.x(k1) - arm1;
  const double distance = std::sqrt(d.dot(d));  // to the last bit what the row has
  s.state.y[node.unknown] = distance;
  if (!node.differential || distance == 0) return;
  const Vec3 velocity = u.v(k2) + u.w(k2).cross(arm2) - u.v(k1) - u.w(k1).cross(arm1);
  s.state.yp[node.unknown] = d.dot(velocity) / distance;
}

void Motor::start(Start& s) const {
  const Local<double>& u = s.u;
  s.own(0) = initial_current;
  const auto declared = [&](int k) { return u.model().scalars[u.connection->scalar[k]].value; };
  const double drop = R->value(*u.context, std::abs(initial_current)) * initial_current;
  if (L != 0) s.own_rate(0) = (declared(1) - declared(0) - speed(u) * G - drop) / L;
}

int Motor::private_datum(std::string_view name) { return index_of(data_names, name); }

double Motor::private_value(const Local<double>& u, int datum) const {
  const double i = u.own(0), voltage = u.scalar(1) - u.scalar(0);
  switch (datum) {
    case 0:
      return speed(u);
    case 1:
      return torque(u);
    case 2:
      return torque(u) * speed(u);
    case 3:
      return voltage;
    case 4:
      return i;
    case 5:
      return u.own_rate(0);
    case 6:
      return voltage * i;
    case 7:
      return mechanical_angle(u);
    case 8:
      return electrical_angle(u);
    case 9:
      return ripple(u, M0);
    case 10:
      return ripple(u, M1) * i;
    default:
      return resistance(u);
  }
}

/// Only for self-describing formats: the lines of .ele belong to electric nodes.
void Motor::output(const Local<double>& u, OutputRow& row) const {
  if (!row.has_named_fields()) return;
  row.begin(OutputFile::ele, u.label());
  row.scalar("M", "N m", torque(u));
  row.scalar("Omega", "rad/s", speed(u));
  row.scalar("i", "A", u.own(0));
  row.scalar("iP", "A/s", u.own_rate(0));
  row.scalar("V1", "V", u.scalar(0));
  row.scalar("V2", "V", u.scalar(1));
  row.end();
}

}  // namespace mbcosim
