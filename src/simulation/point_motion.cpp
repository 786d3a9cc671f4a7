#include "simulation/point_motion.h"

namespace mbcosim {
namespace {

Vec3 vector_at(const Simulation& simulation, int handle, std::vector<double>& scratch) {
  if (handle < 0) return Vec3::Zero();
  scratch.clear();
  simulation.get(handle, scratch);
  return Vec3(scratch[0], scratch[1], scratch[2]);
}

Mat3 matrix_at(const Simulation& simulation, int handle, std::vector<double>& scratch) {
  if (handle < 0) return Mat3::Identity();
  scratch.clear();
  simulation.get(handle, scratch);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(scratch.data());
}

}  // namespace

PointState relative_to(const PointState& r, const PointState& point) {
  const Mat3 to_reference = r.R.transpose();
  const Vec3 dx = point.x - r.x;
  const Vec3 dv = point.v - r.v - r.w.cross(dx);
  PointState m;
  m.x = to_reference * dx;
  m.R = to_reference * point.R;
  m.v = to_reference * dv;
  m.w = to_reference * (point.w - r.w);
  m.a = to_reference *
        (point.a - r.a - r.wp.cross(dx) - r.w.cross(r.w.cross(dx)) - 2 * r.w.cross(dv));
  m.wp = to_reference * (point.wp - r.wp - r.w.cross(point.w));
  return m;
}

PointMotion::PointMotion(const Simulation& simulation, const std::vector<int>& nodes,
                         const std::vector<Vec3>& offsets) {
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const std::string prefix =
        "node.structural." + std::to_string(simulation.model().structural[nodes[k]].label) + ".";
    const auto handle = [&](const char* name) { return simulation.find_variable(prefix + name); };
    points_.push_back({handle("X"), handle("R"), handle("XP"), handle("Omega"), handle("XPP"),
                       handle("OmegaP"), offsets[k]});
  }
}

PointState PointMotion::at(const Simulation& simulation, int k) const {
  const Point& point = points_[k];
  std::vector<double> scratch;
  const auto get = [&](int handle) { return vector_at(simulation, handle, scratch); };
  PointState m;
  m.R = matrix_at(simulation, point.R, scratch);
  m.w = get(point.w);
  const Vec3 arm = m.R * point.offset;
  m.x = get(point.x) + arm;
  m.v = get(point.v) + m.w.cross(arm);
  if (point.a < 0) return m;
  m.wp = get(point.wp);
  m.a = get(point.a) + m.wp.cross(arm) + m.w.cross(m.w.cross(arm));
  return m;
}

const StructuralPort* find_structural_port(const Model& model, const std::string& name) {
  for (const StructuralPort& port : model.structural_ports)
    if (port.name == name) return &port;
  return nullptr;
}

}  // namespace mbcosim
