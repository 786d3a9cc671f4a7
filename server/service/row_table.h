/// Rows of values on their way from a stepping session to the call that asked for them.
#pragma once

#include <cstdint>

#include "mbcosim/v1/simulations.pb.h"
#include "service/variable_access.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// One thread at a time.
class RowTable {
 public:
  /// Throws BAD_ARGUMENT, NO_SUCH_VARIABLE, LIMIT_EXCEEDED.
  RowTable(const v1::TableRequest& request, const VariableAccess& variables, MemoryBudget& memory);

  /// The state at the beginning.
  void start(const Simulation& simulation);
  /// The state after a step.
  void add(const Simulation& simulation);
  /// The end of the run: its last step has a row in any case.
  void finish(const Simulation& simulation);

  /// Is it time to send?
  bool full() const { return values_of(block_) >= kBlockValues; }
  bool empty() const { return block_.steps_size() == 0; }
  /// The rows so far, which are taken out.
  void take(v1::TableBlock* out);

 private:
  static constexpr int kBlockValues = 32 << 10;
  static int values_of(const v1::TableBlock& block) {
    return block.values_size() + 2 * block.steps_size();
  }
  void put(const Simulation& simulation);

  const VariableAccess& variables_;
  const google::protobuf::RepeatedField<int> handles_;
  const std::int64_t every_;
  const bool with_start_;
  MemoryShare share_;       ///< of a full block and one that is being sent
  std::int64_t since_ = 0;  ///< steps without a row
  v1::TableBlock block_;
};

}  // namespace mbcosim::server
