#include "solver/workspace.h"

#include <algorithm>

namespace mbcosim {

void Workspace::set_threads(int threads) {
  const int unknowns = static_cast<int>(residual.size());
  const int most = std::min(threads, LinearSolver::threads_of_use(unknowns));
  evaluators = most > 1 ? std::make_unique<Evaluators>(most, scratch) : nullptr;
  solver.set_team(team());
}

}  // namespace mbcosim
