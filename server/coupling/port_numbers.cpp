#include "coupling/port_numbers.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "math/rotation.h"

namespace mbcosim::server {

void put(const Vec3& v, Numbers* out) { out->Add(v.data(), v.data() + 3); }

namespace {

void put_quaternion(const Mat3& R, Numbers* out) {
  Eigen::Quaterniond q(R);
  q.normalize();
  const double sign = q.w() < 0 ? -1 : 1;
  for (const double component : {q.w(), q.x(), q.y(), q.z()}) out->Add(sign * component);
}

// R = R_x(a) R_y(b) R_z(c)
Vec3 euler_123(const Mat3& R) {
  const double b = std::asin(std::clamp(R(0, 2), -1.0, 1.0));
  return {std::atan2(-R(1, 2), R(2, 2)), b, std::atan2(-R(0, 1), R(0, 0))};
}

}  // namespace

void put_rotation(const Mat3& R, v1::RotationForm form, Numbers* out) {
  switch (form) {
    case v1::ROTATION_FORM_VECTOR:
      return put(vector_of_rotation(R), out);
    case v1::ROTATION_FORM_QUATERNION:
      return put_quaternion(R, out);
    case v1::ROTATION_FORM_EULER_123:
      return put(euler_123(R), out);
    default:
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out->Add(R(i, j));
  }
}

Vec3 triple(const Numbers& numbers, std::size_t i) {
  return Vec3(numbers.Get(static_cast<int>(3 * i)), numbers.Get(static_cast<int>(3 * i + 1)),
              numbers.Get(static_cast<int>(3 * i + 2)));
}

std::string check_array(const char* name, const Numbers& numbers, std::size_t size,
                        bool may_be_empty) {
  if (may_be_empty && numbers.empty()) return "";
  if (static_cast<std::size_t>(numbers.size()) != size)
    return std::string("`") + name + "` must have " + std::to_string(size) + " numbers, got " +
           std::to_string(numbers.size());
  for (const double number : numbers)
    if (!std::isfinite(number))
      return std::string("`") + name + "` has a number that is not finite";
  return "";
}

int rotation_size(v1::RotationForm form) {
  switch (form) {
    case v1::ROTATION_FORM_VECTOR:
    case v1::ROTATION_FORM_EULER_123:
      return 3;
    case v1::ROTATION_FORM_QUATERNION:
      return 4;
    default:
      return 9;
  }
}

Mat3 nearest_rotation(const Mat3& A) {
  const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 sign = Mat3::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign(2, 2) = -1;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

bool take_rotation(const Numbers& numbers, int at, v1::RotationForm form, Mat3* R) {
  constexpr double kTolerance = 1e-3;
  const double* n = numbers.data() + at;
  const Vec3 v(n[0], n[1], n[2]);
  switch (form) {
    case v1::ROTATION_FORM_VECTOR: {
      const double angle = v.norm();
      *R = angle > 0 ? Mat3(Eigen::AngleAxisd(angle, v / angle)) : Mat3(Mat3::Identity());
      return true;
    }
    case v1::ROTATION_FORM_EULER_123:
      *R = Eigen::AngleAxisd(v(0), Vec3::UnitX()) * Eigen::AngleAxisd(v(1), Vec3::UnitY()) *
           Eigen::AngleAxisd(v(2), Vec3::UnitZ());
      return true;
    case v1::ROTATION_FORM_QUATERNION: {
      const Eigen::Quaterniond q(n[0], n[1], n[2], n[3]);
      *R = q.normalized().toRotationMatrix();
      return std::abs(q.norm() - 1) < kTolerance;
    }
    default: {
      const Mat3 A = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(n);
      *R = nearest_rotation(A);
      return (A - *R).norm() < kTolerance;
    }
  }
}

}  // namespace mbcosim::server
