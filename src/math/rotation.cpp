#include "math/rotation.h"

namespace mbcosim {

MBCOSIM_ROTATIONS(, TimeDual)
MBCOSIM_ROTATIONS(, Dual<6>)
MBCOSIM_ROTATIONS(, Dual<12>)
MBCOSIM_ROTATIONS(, Dual<18>)
MBCOSIM_ROTATIONS(, Dual<24>)
#undef MBCOSIM_ROTATIONS

Vec3 euler123_of_rotation(const Mat3& r) {
  const double a = std::atan2(-r(1, 2), r(2, 2));
  const double ca = std::cos(a), sa = std::sin(a);
  const double b = std::atan2(r(0, 2), ca * r(2, 2) - sa * r(1, 2));
  const double c = std::atan2(ca * r(1, 0) + sa * r(2, 0), ca * r(1, 1) + sa * r(2, 1));
  return {a, b, c};
}

Vec3 euler313_of_rotation(const Mat3& r) {
  const double a = std::atan2(r(0, 2), -r(1, 2));
  const double ca = std::cos(a), sa = std::sin(a);
  const double b = std::atan2(sa * r(0, 2) - ca * r(1, 2), r(2, 2));
  const double c = std::atan2(-ca * r(0, 1) - sa * r(1, 1), ca * r(0, 0) + sa * r(1, 0));
  return {a, b, c};
}

Vec3 euler321_of_rotation(const Mat3& r) {
  const double a = std::atan2(r(1, 0), r(0, 0));
  const double ca = std::cos(a), sa = std::sin(a);
  const double b = std::atan2(-r(2, 0), ca * r(0, 0) + sa * r(1, 0));
  const double c = std::atan2(sa * r(0, 2) - ca * r(1, 2), -sa * r(0, 1) + ca * r(1, 1));
  return {a, b, c};
}

Mat3 rotation_of_euler123(const Vec3& a) {
  return rotation_x(a(0)) * rotation_y(a(1)) * rotation_z(a(2));
}
Mat3 rotation_of_euler313(const Vec3& a) {
  return rotation_z(a(0)) * rotation_x(a(1)) * rotation_z(a(2));
}
Mat3 rotation_of_euler321(const Vec3& a) {
  return rotation_z(a(0)) * rotation_y(a(1)) * rotation_x(a(2));
}

}  // namespace mbcosim
