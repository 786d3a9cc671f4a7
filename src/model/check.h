/// Checks of what no input can cause: mistakes of this program. Always on.
///
///     MBCOSIM_CHECK(c.node_count < kMaxNodes, "an element connects more nodes than there is room
///     for");
///
/// They stand where a mistake would write past an array or use what is not there, not in loops over
/// entries. What fails throws InternalError: the deck's reader refuses the deck with it, a session
/// of the server fails alone, and the command line ends with an exit code of its own.
#pragma once

#include <stdexcept>

namespace mbcosim {

/// A mistake of this program. what(): condition, place and meaning.
class InternalError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Throws; `file`: as the compiler names it.
[[noreturn]] void fail_check(const char* condition, const char* file, int line,
                             const char* meaning);

}  // namespace mbcosim

#define MBCOSIM_CHECK(condition, meaning)                             \
  do {                                                                \
    if (!(condition)) [[unlikely]]                                    \
      ::mbcosim::fail_check(#condition, __FILE__, __LINE__, meaning); \
  } while (false)
