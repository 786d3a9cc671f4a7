#include "solver/singularity.h"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>
#include <set>

namespace mbcosim {

namespace {

constexpr int kDenseLimit = 2000;
constexpr double kRankThreshold = 1e-13;  ///< relative to the largest pivot, on rows scaled to unit maximum

/// Owners of the rows where |v| is large, at most `count`.
std::vector<WorstEquation> owners(const Model& model, const VecX& v, int count) {
  std::vector<int> order(v.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return std::abs(v(a)) > std::abs(v(b)); });
  std::vector<WorstEquation> r;
  for (int k = 0; k < std::min<int>(count, static_cast<int>(order.size())); ++k) {
    if (std::abs(v(order[k])) < 0.1 * std::abs(v(order[0])) || v(order[k]) == 0) break;
    const auto [owner, equation] = model.row_text(order[k]);
    r.push_back({owner, equation, v(order[k])});
  }
  return r;
}

std::string joined(const std::vector<WorstEquation>& list) {
  std::string s;
  for (const WorstEquation& w : list) s += (s.empty() ? "" : "; ") + w.owner + ", " + w.equation;
  return s;
}

}  // namespace

std::string Singularity::text() const {
  std::string s = "the matrix is singular";
  if (rank_loss > 0) s += " (rank loss " + std::to_string(rank_loss) + ")";
  if (!undetermined.empty()) s += "\n  nothing determines: " + joined(undetermined);
  if (!redundant.empty()) s += "\n  redundant or empty equations: " + joined(redundant);
  return s;
}

Singularity find_singularity(const Model& model, const std::vector<double>& values, int column) {
  Singularity r;
  const int n = model.unknowns;
  if (n > kDenseLimit) {
    if (column >= 0) {
      const auto [owner, equation] = model.row_text(column);
      r.undetermined.push_back({owner, equation, 1});
    }
    return r;
  }
  MatX a = MatX::Zero(n, n);
  for (int j = 0; j < n; ++j)
    for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k) a(model.row_index[k], j) = values[k];
  if (!a.allFinite()) return r;
  for (int i = 0; i < n; ++i)
    if (const double m = a.row(i).cwiseAbs().maxCoeff(); m > 0) a.row(i) /= m;
  Eigen::FullPivLU<MatX> lu;
  lu.setThreshold(kRankThreshold);
  lu.compute(a);
  r.rank_loss = n - static_cast<int>(lu.rank());
  if (r.rank_loss == 0) return r;
  r.undetermined = owners(model, lu.kernel().rowwise().norm(), 4);
  lu.compute(a.transpose());
  r.redundant = owners(model, lu.kernel().rowwise().norm(), 4);
  return r;
}

}  // namespace mbcosim
