/// A peer's last answers, and what they say about times between exchanges.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

namespace mbcosim::server {

/// Polynomial through the last one, two or three answers (Lagrange), evaluated at or after the
/// newest.
class InputHistory {
 public:
  /// `most`: answers that count, 1 (held), 2 (linear) or 3 (quadratic).
  explicit InputHistory(std::size_t most) : most_(most) {}
  void clear() { points_.clear(); }
  bool empty() const { return points_.empty(); }
  void add(double time, const std::vector<double>& values);
  /// Values at `time` [s]. There must be an answer.
  std::vector<double> at(double time) const;

  struct Point {
    double time;
    std::vector<double> values;
  };
  const std::deque<Point>& points() const { return points_; }  ///< oldest first

 private:
  std::size_t most_;
  std::deque<Point> points_;
};

}  // namespace mbcosim::server
