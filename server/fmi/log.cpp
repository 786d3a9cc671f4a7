#include "fmi/log.h"

namespace mbcosim::fmi {

void Log::write(Status status, const std::string& message) const {
  const std::size_t category = static_cast<std::size_t>(status);
  if (!sink_ || (enabled_ >> category & 1) == 0) return;
  std::string text;
  for (const char c : message) text.append(c == '#' ? 2 : 1, c);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  sink_(status, kLogCategories[category].name, text.c_str());
}

bool Log::switch_one(const std::string& category, bool on) {
  for (std::size_t k = 0; k < kLogCategories.size(); ++k)
    if (category == kLogCategories[k].name) {
      if (on)
        enabled_ |= 1u << k;
      else
        enabled_ &= ~(1u << k);
      return true;
    }
  return false;
}

}  // namespace mbcosim::fmi
