#include "coupling/fixed_point.h"

#include <Eigen/QR>
#include <algorithm>

namespace mbcosim::server {

void FixedPoint::start() {
  omega_ = relaxation_;
  residuals_.clear();
  answers_.clear();
}

Eigen::VectorXd FixedPoint::next(const Eigen::VectorXd& x, const Eigen::VectorXd& answer) {
  const Eigen::VectorXd r = answer - x;
  switch (kind_) {
    case Acceleration::constant:
      return x + relaxation_ * r;
    case Acceleration::aitken:
      return aitken(x, r);
    case Acceleration::iqn_ils:
      return quasi_newton(x, answer, r);
    case Acceleration::none:
      break;
  }
  return answer;
}

Eigen::VectorXd FixedPoint::aitken(const Eigen::VectorXd& x, const Eigen::VectorXd& r) {
  if (!residuals_.empty()) {
    const Eigen::VectorXd dr = r - residuals_.back();
    const double squared = dr.squaredNorm();
    if (squared > 0) omega_ = -omega_ * residuals_.back().dot(dr) / squared;
  }
  residuals_.assign(1, r);
  return x + omega_ * r;
}

Eigen::VectorXd FixedPoint::quasi_newton(const Eigen::VectorXd& x, const Eigen::VectorXd& answer,
                                         const Eigen::VectorXd& r) {
  residuals_.push_back(r);
  answers_.push_back(answer);
  // As many secants as there are, newest first, but not more than interface values.
  const int columns = static_cast<int>(std::min<std::size_t>(residuals_.size() - 1, x.size()));
  if (columns == 0) return x + relaxation_ * r;
  Eigen::MatrixXd dr(x.size(), columns), da(x.size(), columns);
  for (int k = 0; k < columns; ++k) {
    const std::size_t newer = residuals_.size() - 1 - k;
    dr.col(k) = residuals_[newer] - residuals_[newer - 1];
    da.col(k) = answers_[newer] - answers_[newer - 1];
  }
  // Nearly dependent columns are dropped by the rank-revealing factorization.
  constexpr double kDependent = 1e-10;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  qr.setThreshold(kDependent);
  qr.compute(dr);
  if (qr.rank() == 0) return answer;
  return answer + da * qr.solve(-r);
}

}  // namespace mbcosim::server
