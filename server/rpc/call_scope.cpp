#include "rpc/call_scope.h"

#include <algorithm>
#include <utility>

namespace mbcosim::server {
namespace {

thread_local const CallLabels* labels_of_thread = nullptr;

bool is_hexadecimal(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

}  // namespace

CallScope::CallScope(const CallLabels& labels) : outer_(std::exchange(labels_of_thread, &labels)) {}
CallScope::~CallScope() { labels_of_thread = outer_; }
const CallLabels* CallScope::current() { return labels_of_thread; }

// "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"; later versions may go on after that.
std::string trace_id_of(std::string_view traceparent) {
  constexpr std::size_t kVersion = 2, kTrace = 32, kBegin = kVersion + 1, kLength = 55;
  if (traceparent.size() < kLength || traceparent[kVersion] != '-' ||
      traceparent[kBegin + kTrace] != '-' || traceparent.substr(0, kVersion) == "ff")
    return "";
  const std::string_view id = traceparent.substr(kBegin, kTrace);
  if (!is_hexadecimal(id) || id.find_first_not_of('0') == std::string_view::npos) return "";
  return std::string(id);
}

}  // namespace mbcosim::server
