#include "solver/workspace.h"

#include <algorithm>

namespace mbcosim {

void Workspace::set_threads(int threads) {
  const int worth = static_cast<int>(residual.size()) / LinearSolver::kUnknownsPerThread;
  const int most = std::min(threads, worth);
  evaluators = most > 1 ? std::make_unique<Evaluators>(most, scratch) : nullptr;
  solver.set_team(team());
}

}  // namespace mbcosim
