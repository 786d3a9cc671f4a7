/// Fixed-size algebra used everywhere: thin names for Eigen's types.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "math/eigen_storage.h"

namespace mbcosim {

template <class T>
using Vec = Eigen::Matrix<T, 3, 1>;
template <class T>
using Mat = Eigen::Matrix<T, 3, 3>;

template <int N>
using VecN = Eigen::Matrix<double, N, 1>;
template <int N>
using MatN = Eigen::Matrix<double, N, N>;

using Vec3 = Vec<double>;
using Mat3 = Mat<double>;
using Vec6 = VecN<6>;
using Mat6 = MatN<6>;
using VecX = Eigen::VectorXd;
using MatX = Eigen::MatrixXd;

/// Skew matrix of `a`: cross(a) b = a × b.
template <class T>
Mat<T> cross(const Vec<T>& a) {
  Mat<T> m;
  m << T(0), -a(2), a(1), a(2), T(0), -a(0), -a(1), a(0), T(0);
  return m;
}

/// ax(A) = ½ (A32−A23, A13−A31, A21−A12): the vector of the skew part of A.
template <class T>
Vec<T> ax(const Mat<T>& a) {
  return Vec<T>((a(2, 1) - a(1, 2)) * 0.5, (a(0, 2) - a(2, 0)) * 0.5, (a(1, 0) - a(0, 1)) * 0.5);
}

}  // namespace mbcosim
