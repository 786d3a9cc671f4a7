/// Linearization and eigenvalues of a state, in pages. They take no slot of the steps: the lane of
/// heavy work bounds them, at a lower priority, so that a few of them starve no step.
#pragma once

#include <functional>

#include "rpc/call.h"
#include "service/reply_pages.h"
#include "service/variable_access.h"

namespace mbcosim::server {

/// Thread-safe. All that it is made of outlives it.
class Analysis {
 public:
  Analysis(const Model& model, const VariableAccess& variables, MemoryBudget& memory)
      : model_(model), variables_(variables), memory_(memory) {}

  /// A copy of the state to analyse, whose step is `*step`.
  using TakeState = std::function<State(std::int64_t* step)>;
  void linearize(const v1::LinearizeRequest& request, const TakeState& take_state, Call& call,
                 v1::LinearizeReply* reply);
  void eigenvalues(const v1::ComputeEigenvaluesRequest& request, const TakeState& take_state,
                   Call& call, v1::ComputeEigenvaluesReply* reply);

 private:
  const Model& model_;
  const VariableAccess& variables_;
  MemoryBudget& memory_;
  ReplyPages<v1::LinearizeReply> linearization_;
  ReplyPages<v1::ComputeEigenvaluesReply> spectrum_;
};

}  // namespace mbcosim::server
