#include "coupling/input_history.h"

namespace mbcosim::server {

void InputHistory::add(double time, const std::vector<double>& values) {
  if (!points_.empty() && points_.back().time >= time)
    points_.clear();  // the simulation went back in time
  points_.push_back({time, values});
  if (points_.size() > most_) points_.pop_front();
}

std::vector<double> InputHistory::at(double time) const {
  std::vector<double> result(points_.back().values.size(), 0.0);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    double weight = 1;
    for (std::size_t j = 0; j < points_.size(); ++j)
      if (j != i) weight *= (time - points_[j].time) / (points_[i].time - points_[j].time);
    for (std::size_t k = 0; k < result.size(); ++k) result[k] += weight * points_[i].values[k];
  }
  return result;
}

}  // namespace mbcosim::server
