/// Where long evaluations of elements look whether they are still wanted.
#pragma once

namespace mbcosim {

/// Asked now and then; throws when they are not.
struct Interruption {
  void (*look)(const void*) = nullptr;  ///< null: they always are
  const void* of = nullptr;             ///< its argument
};

/// While it lives this thread asks the interruption, which outlives it.
class EvaluationWatch {
 public:
  explicit EvaluationWatch(const Interruption& interruption) : before_(current_) {
    current_ = &interruption;
  }
  ~EvaluationWatch() { current_ = before_; }
  EvaluationWatch(const EvaluationWatch&) = delete;
  EvaluationWatch& operator=(const EvaluationWatch&) = delete;

  static constexpr int kOfElement = 4;  ///< evaluations that one element counts for

  /// So many drives, functions or terms of a series were evaluated, a tenth of a microsecond each
  /// or so.
  static void count(int evaluations) {
    if ((since_look_ += evaluations) < kPiece) return;
    since_look_ = 0;
    if (current_ && current_->look) current_->look(current_->of);
  }

 private:
  static constexpr int kPiece = 1000;
  inline static thread_local int since_look_ = 0;
  inline static thread_local const Interruption* current_ = nullptr;
  const Interruption* const before_;
};

}  // namespace mbcosim
