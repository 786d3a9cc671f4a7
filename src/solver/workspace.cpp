#include "solver/workspace.h"

#include <algorithm>

namespace mbcosim {

void Workspace::set_threads(int threads) {
  constexpr int kUnknowns = 3000;  // for each thread: with fewer they wait for each other
  const int most = std::min(threads, static_cast<int>(residual.size()) / kUnknowns);
  evaluators = most > 1 ? std::make_unique<Evaluators>(most, scratch) : nullptr;
  solver.set_team(team());
}

}  // namespace mbcosim
