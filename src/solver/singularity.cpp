#include "solver/singularity.h"

#include <algorithm>
#include <numeric>

#include "solver/null_space.h"

namespace mbcosim {

namespace {

constexpr double kRankThreshold = 1e-13, kNearThreshold = 1e-10;
constexpr int kNearLimit = 400;
constexpr int kNamed = 6;  ///< equations that a message names

Eigen::SparseMatrix<double> sparse(const Model& model, const std::vector<double>& values) {
  const int n = model.unknowns;
  return Eigen::Map<const Eigen::SparseMatrix<double>>(
      n, n, static_cast<int>(model.row_index.size()), model.column_start.data(),
      model.row_index.data(), values.data());
}

/// Is the unknown with the largest share one of a node with bodies?
bool is_of_bodies(const Model& model, const VecX& share) {
  int largest = 0;
  share.cwiseAbs().maxCoeff(&largest);
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    const StructuralNode& n = model.structural[k];
    if (n.first >= 0 && largest >= n.first && largest < n.first + n.unknowns())
      return !model.node_bodies[k].empty();
  }
  return false;
}

Singularity look(const Model& model, const std::vector<double>& values, double threshold,
                 const Watch& watch) {
  Singularity r;
  if (values.size() != model.row_index.size()) return r;
  const NullSpace null = find_null_space(sparse(model, values), threshold, watch);
  r.rank_loss = null.rank_loss;
  if (r.rank_loss == 0) return r;
  r.undetermined = owners_of(model, null.right, kNamed);
  r.redundant = owners_of(model, null.left, kNamed);
  r.massless = is_of_bodies(model, null.right);
  return r;
}

}  // namespace

std::vector<WorstEquation> owners_of(const Model& model, const VecX& share, int count) {
  std::vector<int> order(share.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(share(a)) > std::abs(share(b)); });
  std::vector<WorstEquation> r;
  for (const int row : order) {
    if (static_cast<int>(r.size()) == count ||
        std::abs(share(row)) < 0.1 * std::abs(share(order[0])) || share(row) == 0)
      break;
    const auto [owner, equation] = model.row_text(row);
    r.push_back({owner, equation, share(row)});
  }
  return r;
}

std::string joined(const std::vector<WorstEquation>& list) {
  std::string s;
  for (const WorstEquation& w : list) s += (s.empty() ? "" : "; ") + w.owner + ", " + w.equation;
  return s;
}

std::string Singularity::text() const { return "the matrix is singular" + details(); }

std::string Singularity::details() const {
  std::string s;
  if (rank_loss > 0) s += " (rank loss " + std::to_string(rank_loss) + ")";
  if (!undetermined.empty()) s += "\n  nothing determines: " + joined(undetermined);
  if (!redundant.empty()) s += "\n  redundant or empty equations: " + joined(redundant);
  return s + (undetermined.empty() ? "" : "\n  hint: " + remedy());
}

std::string Singularity::remedy() const {
  const auto of_node = [](const WorstEquation& w) {
    return w.owner.find(" node ") != std::string::npos;
  };
  const bool nodes = std::all_of(undetermined.begin(), undetermined.end(), of_node);
  if (nodes && massless)
    return "the bodies there have no inertia for these motions: give them mass and moments of "
           "inertia, or constrain the motions (a point mass wants a displacement node)";
  if (nodes)
    return "no element holds these: give the node a body, a joint (`clamp` for the ground) or "
           "another element, or remove it";
  return std::string("remove redundant constraints, or regularize one of their joints ") +
         kRegularization;
}

Singularity find_singularity(const Model& model, const std::vector<double>& values, int column,
                             const Watch& watch) {
  Singularity r = look(model, values, kRankThreshold, watch);
  if (r.undetermined.empty() && column >= 0) {
    const auto [owner, equation] = model.row_text(column);
    r.undetermined.push_back({owner, equation, 1});
  }
  return r;
}

Singularity find_near_singularity(const Model& model, const std::vector<double>& values) {
  return model.unknowns > kNearLimit ? Singularity{} : look(model, values, kNearThreshold, Watch());
}

}  // namespace mbcosim
