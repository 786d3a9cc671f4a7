/// Refusals of the reduction: thrown inside, returned as `Error` by `reduce`.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include "model/diagnostic.h"

namespace mbcosim {

/// What is wrong, and how to mend it.
class ReductionError : public std::runtime_error {
 public:
  ReductionError(ErrorKind kind, const std::string& message, const std::string& hint = "")
      : std::runtime_error(hint.empty() ? message : message + " (" + hint + ")"), kind(kind) {}
  ErrorKind kind;
};

/// Input files or options that cannot be used.
[[noreturn]] inline void refuse_reduction(const std::string& message,
                                          const std::string& hint = "") {
  throw ReductionError(ErrorKind::argument, message, hint);
}

/// Somebody asked to stop.
[[noreturn]] inline void stop_reduction() {
  throw ReductionError(ErrorKind::cancelled, "the reduction was stopped");
}

/// Tells what is being done and how much of it is done, 0 to 1; false asks to stop.
using ReductionProgress = std::function<bool(const std::string& phase, double fraction)>;

}  // namespace mbcosim
