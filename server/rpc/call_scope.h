/// What a thread works for, so that logs and events can tell.
#pragma once

#include <string>
#include <string_view>

namespace mbcosim::server {

struct CallLabels {
  std::string method;      ///< "Simulations/Step"
  std::string identity;    ///< of the caller
  std::string request_id;  ///< as the client chose; empty: none
  std::string trace_id;    ///< 32 hexadecimal digits; empty: none
};

/// While it lives, this thread works for a call. Scopes may stand within each other.
class CallScope {
 public:
  explicit CallScope(const CallLabels& labels);
  ~CallScope();
  CallScope(const CallScope&) = delete;
  CallScope& operator=(const CallScope&) = delete;
  /// Null: the thread works for no call.
  static const CallLabels* current();

 private:
  const CallLabels* const outer_;
};

/// The trace-id of a `traceparent` (W3C Trace Context, level 1); empty when it is none.
std::string trace_id_of(std::string_view traceparent);

}  // namespace mbcosim::server
