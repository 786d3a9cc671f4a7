#include "elements/electric/electric.h"

namespace mbcosim {

void Accelerometer::start(Start& s) const {
  const Vec3 e = s.u.R(0) * e0;
  s.own(0) = rotational ? e.dot(s.u.w(0)) : e.dot(s.u.v(0) + s.u.w(0).cross(s.u.R(0) * f));
}

void FilteredAccelerometer::start(Start& s) const { s.own(2) = -(s.u.R(0) * e0).dot(s.u.v(0)); }

int Motor::private_datum(std::string_view name) { return index_of(data_names, name); }

double Motor::private_value(const Local<double>& u, int datum) const {
  switch (datum) {
    case 0:
      return torque(u);
    case 1:
      return (u.R(0) * Rh.col(2)).dot(u.w(1) - u.w(0));
    case 2:
      return u.own(0);
    default:
      return ripple(u, datum == 3 ? M0 : M1);
  }
}

/// Only for self-describing formats: the lines of .ele belong to electric nodes.
void Motor::output(const Local<double>& u, OutputRow& row) const {
  if (!row.has_named_fields()) return;
  row.begin(OutputFile::ele, u.label());
  row.scalar("M", "N m", private_value(u, 0));
  row.scalar("Omega", "rad/s", private_value(u, 1));
  row.scalar("i", "A", u.own(0));
  row.scalar("iP", "A/s", u.own_rate(0));
  row.scalar("V1", "V", u.scalar(0));
  row.scalar("V2", "V", u.scalar(1));
  row.end();
}

}  // namespace mbcosim
