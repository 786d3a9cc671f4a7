#include "elements/ports/mapped_modal.h"

namespace mbcosim {

namespace {

Vec3 axial_part(const Mat3& A) {
  return .5 * Vec3(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1));
}

}  // namespace

MappedModal::MappedModal(ElementPort port, Settings settings, const Model& model,
                         const EvalContext& input)
    : port_(std::move(port)), settings_(std::move(settings)) {
  for (std::size_t k = 0; k < settings_.nodes.size(); ++k) {
    const NodeState n = relative(model, input, static_cast<int>(k));
    x0_.push_back(n.x);
    R0_.push_back(n.R);
  }
}

const double* MappedModal::modal_forces(const State& state) const {
  return &state.memory[port_.memory + (is_rigid() ? 6 : 0)];
}

/// Node k as the reference node sees it.
NodeState MappedModal::relative(const Model& model, const EvalContext& context, int k) const {
  NodeState n = model.node_state(context, settings_.nodes[k]);
  if (settings_.reference < 0) return n;
  const NodeState r = model.node_state(context, settings_.reference);
  const Vec3 d = n.x - r.x;
  n.x = r.R.transpose() * d;
  n.R = r.R.transpose() * n.R;
  n.v = r.R.transpose() * (n.v - r.v + d.cross(r.w));
  n.w = r.R.transpose() * (n.w - r.w);
  return n;
}

MappedModal::Motion MappedModal::motion(const GeneralView& u) const {
  const auto size = static_cast<Eigen::Index>(6 * settings_.nodes.size());
  Motion m{VecX(size), VecX(size)};
  for (std::size_t k = 0; k < settings_.nodes.size(); ++k) {
    const NodeState n = relative(u.model(), u.context, static_cast<int>(k));
    const auto first = static_cast<Eigen::Index>(6 * k);
    m.xi.segment<3>(first) = n.x - x0_[k];
    m.xi.segment<3>(first + 3) = axial_part(n.R * R0_[k].transpose());
    m.xi_rate.segment<3>(first) = n.v;
    m.xi_rate.segment<3>(first + 3) = n.w;
  }
  return m;
}

void MappedModal::outputs(const GeneralView& u, std::vector<double>& out) const {
  if (port_.output_size == 0) return;
  const Motion m = motion(u);
  const VecX q = settings_.H * m.xi, q_rate = settings_.H * m.xi_rate;
  out.insert(out.end(), q.data(), q.data() + q.size());
  out.insert(out.end(), q_rate.data(), q_rate.data() + q_rate.size());
}

void MappedModal::connect(GeneralConnection& c) {
  for (const int node : settings_.nodes) rows_.push_back(c.node(node));
  if (settings_.reference >= 0) reference_row_ = c.node(settings_.reference);
}

void MappedModal::pattern(GeneralPattern& p) const {
  if (reference_row_ < 0) return;
  for (const int row : rows_) {
    p.block(row, 6, reference_row_, 6);
    p.block(reference_row_, 6, row, 6);
  }
  p.block(reference_row_, 6, reference_row_, 6);
}

/// f_i, m_i of each node.
std::vector<MappedModal::Load> MappedModal::loads(const GeneralView& u) const {
  std::vector<Load> loads(settings_.nodes.size(), Load{Vec3::Zero(), Vec3::Zero()});
  if (port_.output_size == 0) return loads;  // no mode has a force
  const VecX f = settings_.H.transpose() * Eigen::Map<const VecX>(modal_forces(u.state()), modes());
  Mat3 turn = Mat3::Identity();
  if (settings_.reference >= 0) turn = u.node(settings_.reference).R;
  for (std::size_t k = 0; k < loads.size(); ++k) {
    const auto first = static_cast<Eigen::Index>(6 * k);
    loads[k] = {turn * f.segment<3>(first), turn * f.segment<3>(first + 3)};
  }
  return loads;
}

/// F₂ = Σ f_i, M₂ = Σ (m_i + (x_i − x_r) × f_i)
MappedModal::Load MappedModal::sum(const GeneralView& u, const std::vector<Load>& loads) const {
  Load total{Vec3::Zero(), Vec3::Zero()};
  const Vec3 x_r = u.node(settings_.reference).x;
  for (std::size_t k = 0; k < loads.size(); ++k) {
    if (settings_.nodes[k] == settings_.reference) continue;
    total.f += loads[k].f;
    total.m += loads[k].m + (u.node(settings_.nodes[k]).x - x_r).cross(loads[k].f);
  }
  return total;
}

/// F₁, M₁
MappedModal::Load MappedModal::rigid_load(const GeneralView& u) const {
  if (!is_rigid() || !settings_.use_rigid_loads) return {Vec3::Zero(), Vec3::Zero()};
  const double* v = &u.state().memory[port_.memory];
  Mat3 turn = Mat3::Identity();
  if (settings_.rotate_rigid_loads) turn = u.node(settings_.reference).R;
  return {turn * Vec3(v[0], v[1], v[2]), turn * Vec3(v[3], v[4], v[5])};
}

void MappedModal::residual(const GeneralView& u, GeneralResidual& r) const {
  const std::vector<Load> nodes = loads(u);
  for (std::size_t k = 0; k < nodes.size(); ++k) r.load(rows_[k], nodes[k].f, nodes[k].m);
  if (!is_rigid()) return;
  const Load total = sum(u, nodes), rigid = rigid_load(u);
  r.load(reference_row_, rigid.f - total.f, rigid.m - total.m);
}

// Loads turn with the reference node: δf = −f× δθ_r; their arms follow the nodes.
void MappedModal::jacobian(const GeneralView& u, GeneralJacobian& j) const {
  const int ref = settings_.reference, own = reference_row_;
  if (ref < 0) return;
  const Mat3 zero = Mat3::Zero();
  const Vec3 x_r = u.node(ref).x;
  const std::vector<Load> nodes = loads(u);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Mat3 fx = cross<double>(nodes[k].f), mx = cross<double>(nodes[k].m);
    j.rotation(rows_[k], own + 3, ref, -fx, zero);
    j.rotation(rows_[k] + 3, own + 3, ref, -mx, zero);
    if (!is_rigid() || settings_.nodes[k] == ref) continue;
    const Mat3 arm = cross<double>(Vec3(u.node(settings_.nodes[k]).x - x_r));
    j.rotation(own, own + 3, ref, fx, zero);
    j.rotation(own + 3, own + 3, ref, mx + arm * fx, zero);
    j.translation(own + 3, rows_[k], fx, zero);
    j.translation(own + 3, own, -fx, zero);
  }
  if (!settings_.rotate_rigid_loads) return;
  const Load rigid = rigid_load(u);
  j.rotation(own, own + 3, ref, -cross<double>(rigid.f), zero);
  j.rotation(own + 3, own + 3, ref, -cross<double>(rigid.m), zero);
}

// As received, as used, and the resultant of the nodes.
void MappedModal::output_reference(const GeneralView& u, const std::vector<Load>& nodes,
                                   OutputRow& row) const {
  const double* v = &u.state().memory[port_.memory];
  const Load used = rigid_load(u), total = sum(u, nodes);
  row.begin_text(OutputFile::frc,
                 std::to_string(u.label()) + "@" +
                     std::to_string(u.model().structural[settings_.reference].label));
  row.vec3("F0", "N", Vec3(v[0], v[1], v[2]));
  row.vec3("M0", "N m", Vec3(v[3], v[4], v[5]));
  row.vec3("F1", "N", used.f);
  row.vec3("M1", "N m", used.m);
  row.vec3("F2", "N", total.f);
  row.vec3("M2", "N m", total.m);
  row.end();
}

void MappedModal::output(const GeneralView& u, OutputRow& row) const {
  const std::string label = std::to_string(u.label());
  const std::vector<Load> nodes = loads(u);
  const Motion m = motion(u);
  if (is_rigid()) output_reference(u, nodes, row);
  if (port_.output_size > 0) {
    const VecX q = settings_.H * m.xi, q_rate = settings_.H * m.xi_rate;
    for (int k = 0; k < modes(); ++k) {
      row.begin_text(OutputFile::frc, label + "." + std::to_string(k + 1));
      row.scalar("p", "", modal_forces(u.state())[k]);
      row.scalar("q", "", q(k));
      row.scalar("qP", "", q_rate(k));
      row.end();
    }
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const auto first = static_cast<Eigen::Index>(6 * k);
    row.begin_text(OutputFile::frc,
                   label + "#" + std::to_string(u.model().structural[settings_.nodes[k]].label));
    row.vec3("F", "N", nodes[k].f);
    row.vec3("M", "N m", nodes[k].m);
    row.values("xi", "", &m.xi(first), 6);
    row.values("xiP", "", &m.xi_rate(first), 6);
    row.end();
  }
}

}  // namespace mbcosim
