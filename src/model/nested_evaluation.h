/// Bounds on evaluations that lead to others in ways which nothing checks when the deck is read:
/// strings, postponed drives and values of elements, to which parameter nodes may be bound.
#pragma once

#include <cstddef>

#include "model/diagnostic.h"
#include "model/evaluation_watch.h"

namespace mbcosim {

/// Lives while such an evaluation goes on; throws EvaluationError when one leads back to itself, or
/// takes more of them than anybody would wait for, as when each refers to others twice.
class NestedEvaluation {
 public:
  NestedEvaluation() {
    const char* const here = static_cast<const char*>(__builtin_frame_address(0));
    if (depth_ == 0) {
      count_ = 0;
      outermost_ = here;
    }
    if (depth_ == kDeepest)
      throw EvaluationError(
          "drives, strings and values of elements refer to each other in a circle");
    if (outermost_ - here > kMostStack)
      throw EvaluationError(
          "drives, laws, strings and values of elements that refer to each other are nested too "
          "deeply");
    ++depth_;
    try {
      charge(1);
    } catch (...) {
      --depth_;
      throw;
    }
  }
  ~NestedEvaluation() { --depth_; }
  NestedEvaluation(const NestedEvaluation&) = delete;
  NestedEvaluation& operator=(const NestedEvaluation&) = delete;

  /// The one that goes on, if any, takes so many evaluations of drives, functions and the like.
  static void charge(int evaluations) {
    EvaluationWatch::count(evaluations);
    if (depth_ > 0 && (count_ += evaluations) > kMost)
      throw EvaluationError(
          "drives, functions, strings and values of elements that refer to each other take too "
          "many evaluations");
  }

 private:
  static constexpr int kDeepest = 64, kMost = 100000;
  /// [bytes] Each of them may go through a long chain.
  static constexpr std::ptrdiff_t kMostStack = 1 << 20;
  inline static thread_local int depth_ = 0, count_ = 0;
  inline static thread_local const char* outermost_ = nullptr;
};

}  // namespace mbcosim
