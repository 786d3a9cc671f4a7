#include "surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace client = mbcosim::client;

namespace {

/// The first components of vectors of three, and back; what is left out is zero.
std::vector<double> resized(const std::vector<double>& vectors, std::size_t from, std::size_t to) {
  std::vector<double> result(vectors.size() / from * to, 0.0);
  const std::size_t common = std::min(from, to);
  for (std::size_t i = 0; i < vectors.size() / from; ++i)
    std::copy_n(vectors.begin() + static_cast<std::ptrdiff_t>(i * from), common,
                result.begin() + static_cast<std::ptrdiff_t>(i * to));
  return result;
}

void check_dimensions(const precice::Participant& participant, const std::string& mesh,
                      const std::string& data) {
  if (data.empty()) return;
  if (participant.getDataDimensions(mesh, data) != participant.getMeshDimensions(mesh))
    throw std::runtime_error("data \"" + data + "\" of mesh \"" + mesh +
                             "\" must be vectors (data:vector in preCICE's configuration)");
}

void check_finite(const std::vector<double>& values, std::size_t dimensions,
                  const std::string& data) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw std::runtime_error("data \"" + data + "\" is not finite at point " +
                               std::to_string(i / dimensions + 1) + " of the port");
}

}  // namespace

Surface::Surface(precice::Participant& participant, const Options& options,
                 const client::Motion& start)
    : participant_(participant),
      mesh_(options.mesh),
      data_(options.data),
      dimensions_(static_cast<std::size_t>(participant.getMeshDimensions(options.mesh))),
      start_(start.x),
      ids_(start.x.size() / 3),
      motion_(start) {
  for (const std::string& data : {data_.force, data_.moment, data_.displacement, data_.velocity})
    check_dimensions(participant, mesh_, data);
  if (dimensions_ == 2 && !data_.moment.empty())
    throw std::runtime_error("moments about z cannot cross a mesh of two dimensions");
  participant.setMeshVertices(mesh_, resized(start_, 3, dimensions_), ids_);
}

void Surface::begin_step(double time, double length) {
  const std::lock_guard lock(mutex_);
  step_start_ = time;
  step_length_ = length;
}

client::Loads Surface::answer(const client::Motion& motion) {
  const std::lock_guard lock(mutex_);
  motion_ = motion;
  // Sums of lengths are rounded in other ways there than here.
  const double after = std::clamp(motion.target_time - step_start_, 0.0, step_length_);
  client::Loads loads;
  loads.forces = read(data_.force, after);
  if (!data_.moment.empty()) loads.moments = read(data_.moment, after);
  return loads;
}

void Surface::write() {
  const std::lock_guard lock(mutex_);
  std::vector<double> displacement = motion_.x;
  for (std::size_t i = 0; i < displacement.size(); ++i) displacement[i] -= start_[i];
  write(data_.displacement, displacement);
  write(data_.velocity, motion_.v);
}

std::vector<double> Surface::read(const std::string& data, double after) {
  std::vector<double> values(ids_.size() * dimensions_, 0.0);
  if (!data.empty()) participant_.readData(mesh_, data, ids_, after, values);
  check_finite(values, dimensions_, data);
  return resized(values, dimensions_, 3);
}

void Surface::write(const std::string& data, const std::vector<double>& values) {
  if (!data.empty()) participant_.writeData(mesh_, data, ids_, resized(values, 3, dimensions_));
}
