/// Where long computations look whether they are still wanted.
#pragma once

#include <algorithm>
#include <cstddef>

#include "model/evaluation_watch.h"
#include "solver/cancel.h"

namespace mbcosim {

/// Thrown where the token was found cancelled.
struct Stopped {};

/// Looks at a token, which may be null.
class Watch {
 public:
  explicit Watch(const CancelToken* cancel = nullptr) : cancel_(cancel) {}
  const CancelToken* token() const { return cancel_; }
  void look() const {
    if (cancel_ && cancel_->cancelled()) throw Stopped{};
  }
  /// Calls f(first, count) for all columns, a few at a time.
  template <class F>
  void columns(std::ptrdiff_t n, F&& f) const {
    constexpr std::ptrdiff_t kPiece = 64;
    for (std::ptrdiff_t first = 0; first < n; first += kPiece) {
      look();
      f(first, std::min(kPiece, n - first));
    }
  }

 private:
  const CancelToken* cancel_;
};

/// For evaluations of elements; the token, which may be null, outlives it.
inline Interruption interruption_by(const CancelToken* cancel) {
  return {[](const void* token) { Watch(static_cast<const CancelToken*>(token)).look(); }, cancel};
}

}  // namespace mbcosim
