#include "model/output_row.h"

namespace mbcosim {

const char* extension(OutputFile file) {
  static constexpr const char* kNames[] = {"mov", "ine", "jnt", "frc", "act", "prs", "hyd", "mod",
                                           "abs", "gen", "ele", "prm", "grv", "thn", "the", "aer",
                                           "rot", "air", "pla", "usr", "rfm", "drv", "trc", "ext"};
  return kNames[static_cast<int>(file)];
}

void OutputRow::orientation(const char* name, const Mat3& r, OrientationDescription description) {
  switch (description) {
    case OrientationDescription::euler123:
      return vec3(name, "deg", euler123_of_rotation(r) * kDegrees);
    case OrientationDescription::euler313:
      return vec3(name, "deg", euler313_of_rotation(r) * kDegrees);
    case OrientationDescription::euler321:
      return vec3(name, "deg", euler321_of_rotation(r) * kDegrees);
    case OrientationDescription::vector:
      return vec3(name, "rad", vector_of_rotation(r));
    case OrientationDescription::matrix:
      break;
  }
  const Mat3 by_rows = r.transpose();
  values(name, "", by_rows.data(), 9);
}

void OutputRow::reactions(const Vec3& f, const Vec3& m, const Vec3& big_f, const Vec3& big_m) {
  vec3("f", "N", f);
  vec3("m", "N m", m);
  vec3("F", "N", big_f);
  vec3("M", "N m", big_m);
}

}  // namespace mbcosim
