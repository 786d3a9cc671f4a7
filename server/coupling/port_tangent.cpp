/// Derivatives of a peer's answer: from its points to the nodes that take the loads.
#include "coupling/port_model.h"
#include "coupling/port_numbers.h"
#include "math/dual.h"

namespace mbcosim::server {
namespace {

using Mat6x6 = Eigen::Matrix<double, 6, 6>;

/// (x, θ) of a point from (x, θ) of its node: δx_p = δx − a× δθ. Its transpose takes loads about
/// the point to the node.
Mat6x6 to_point(const Vec3& arm) {
  Mat6x6 T = Mat6x6::Identity();
  T.topRightCorner<3, 3>() = -cross<double>(arm);
  return T;
}

/// What a velocity of the point owes to the node's rotation: δv_p = … − w× a× δθ.
Mat6x6 spin(const Vec3& w, const Vec3& arm) {
  Mat6x6 W = Mat6x6::Zero();
  W.topRightCorner<3, 3>() = -cross<double>(w) * cross<double>(arm);
  return W;
}

MatX unpack(const Numbers& numbers, int rows, int columns) {
  if (numbers.empty()) return {};
  using ByRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const ByRows>(numbers.data(), rows, columns);
}

}  // namespace

bool PortModel::takes_tangents() const {
  if (layout_.kind() == v1::PORT_KIND_MODAL)
    return points_.empty() && layout_.input_size() > 0 && element_->element->first_mode_row() >= 0;
  return layout_.kind() == v1::PORT_KIND_STRUCTURAL && !layout_.reference_loads() && !is_mapped();
}

LoadTangent PortModel::tangent(const Agreement& agreement) const {
  LoadTangent t;
  t.block_diagonal = agreement.tangent == v1::TANGENT_FORM_BLOCK_DIAGONAL;
  if (layout_.kind() == v1::PORT_KIND_MODAL) {
    t.modes = layout_.input_size();
    t.first_mode_row = element_->element->first_mode_row();
    t.first_amplitude = element_->element->first_amplitude();
    return t;
  }
  for (const int label : layout_.node_labels()) t.nodes.push_back(model_->find_structural(label));
  return t;
}

std::string PortModel::decode_tangent(const v1::PeerAnswer& in, const Agreement& agreement,
                                      Answer* answer) const {
  if (!in.has_tangent()) return "";
  if (!agreement.has_tangent()) return "`tangent` was not announced in `hello`";
  const v1::Tangent& tangent = in.tangent();
  const bool blocks = agreement.tangent == v1::TANGENT_FORM_BLOCK_DIAGONAL;
  const bool modal = layout_.kind() == v1::PORT_KIND_MODAL;
  if (tangent.block_diagonal() != blocks)
    return "`tangent.block_diagonal` differs from what `hello` announced";
  const int size = modal ? layout_.input_size() : 6 * static_cast<int>(points_.size());
  const int columns = blocks && !modal ? 6 : size;
  const auto count = static_cast<std::size_t>(size) * static_cast<std::size_t>(columns);
  std::string wrong = check_array("tangent.stiffness", tangent.stiffness(), count, true);
  if (wrong.empty()) wrong = check_array("tangent.damping", tangent.damping(), count, true);
  if (!wrong.empty()) return wrong;
  answer->has_tangent = true;
  answer->stiffness = unpack(tangent.stiffness(), size, columns);
  answer->damping = unpack(tangent.damping(), size, columns);
  if (!modal) move_to_nodes(in, agreement, answer);
  return "";
}

// K ← Tᵀ (K T + C W), C ← Tᵀ C T for each pair of points. Loads that are held about the nodes turn
// with the arms: M = m + a × F, so that F× a× δθ joins; the element of a deck's port has that in
// its own matrix.
void PortModel::move_to_nodes(const v1::PeerAnswer& in, const Agreement& agreement,
                              Answer* answer) const {
  const bool blocks = agreement.tangent == v1::TANGENT_FORM_BLOCK_DIAGONAL;
  const int n = static_cast<int>(points_.size());
  if (answer->stiffness.size() == 0) answer->stiffness = MatX::Zero(6 * n, blocks ? 6 : 6 * n);
  for (int i = 0; i < n; ++i) {
    const Mat6x6 load = to_point(sent_[i].arm).transpose();
    for (int j = blocks ? i : 0; j < (blocks ? i + 1 : n); ++j) {
      const Mat6x6 T = to_point(sent_[j].arm);
      auto K = answer->stiffness.block<6, 6>(6 * i, blocks ? 0 : 6 * j);
      Mat6x6 sum = K * T;
      if (answer->damping.size() > 0) {
        auto C = answer->damping.block<6, 6>(6 * i, blocks ? 0 : 6 * j);
        sum += C * spin(sent_[j].w, sent_[j].arm);
        C = (load * C * T).eval();
      }
      K = load * sum;
      if (i == j && deck_loads_ < 0)
        K.bottomRightCorner<3, 3>() +=
            cross<double>(triple(in.forces(), static_cast<std::size_t>(i))) *
            cross<double>(sent_[i].arm);
    }
  }
}

}  // namespace mbcosim::server
