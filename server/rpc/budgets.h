/// The memory that callers may take.
#pragma once

#include <map>
#include <string>

#include "threads/mutex.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// The daemon's budget, and the part of each identity in it. Thread-safe.
class MemoryBudgets {
 public:
  /// `identity_most`: of one identity.
  MemoryBudgets(std::int64_t most, std::int64_t identity_most)
      : all_(most), identity_most_(identity_most) {}
  /// Lives as long as this.
  MemoryBudget& of(const std::string& identity) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    return parts_.try_emplace(identity, identity_most_, &all_).first->second;
  }

  const MemoryBudget& all() const { return all_; }

 private:
  MemoryBudget all_;
  const std::int64_t identity_most_;
  Mutex mutex_;
  std::map<std::string, MemoryBudget> parts_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
