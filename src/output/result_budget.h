/// How many bytes the result files of one simulation may take.
#pragma once

#include <cstdint>
#include <string>

#include "model/diagnostic.h"

namespace mbcosim {

/// One thread at a time.
class ResultBudget {
 public:
  explicit ResultBudget(std::int64_t most) : most_(most) {}
  std::int64_t most() const { return most_; }
  std::int64_t used() const { return used_; }
  /// False: so much is not left, and nothing was taken.
  bool take(std::int64_t bytes) {
    if (bytes > most_ - used_) return false;
    used_ += bytes;
    return true;
  }
  void give_back(std::int64_t bytes) { used_ -= bytes; }

 private:
  const std::int64_t most_;
  std::int64_t used_ = 0;
};

/// ErrorKind::limit: so much may be taken, and no more.
inline Error over_budget(const ResultBudget& budget) {
  return make_error(ErrorKind::limit, "results_bytes",
                    "the result files may take " + std::to_string(budget.most()) + " bytes");
}

}  // namespace mbcosim
