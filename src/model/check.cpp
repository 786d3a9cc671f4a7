#include "model/check.h"

#include <string>
#include <string_view>

namespace mbcosim {

void fail_check(const char* condition, const char* file, int line, const char* meaning) {
  std::string_view place = file;
  if (const std::size_t source = place.rfind("src/"); source != place.npos)
    place.remove_prefix(source);
  throw InternalError("internal error: " + std::string(meaning) + " (" + std::string(place) + ":" +
                      std::to_string(line) + ", " + condition +
                      "); this is a mistake in mbcosim, not in the deck: please report it");
}

}  // namespace mbcosim
