#include "cli/json.h"

#include <nlohmann/json.hpp>

namespace mbcosim::cli {

using Json = nlohmann::ordered_json;

namespace {

// Decks may hold any bytes; what is not UTF-8 is replaced, never refused.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string diagnostics_json(const LoadReport& report) {
  Json list = Json::array();
  for (const Diagnostic& d : report.diagnostics) {
    list.push_back({{"severity", severity_name(d.severity)},
                    {"code", d.code},
                    {"file", d.file},
                    {"line", d.line},
                    {"column", d.column},
                    {"length", d.length},
                    {"message", d.message},
                    {"source_line", d.source_line},
                    {"hint", d.hint},
                    {"trail", d.trail}});
  }
  return dump({{"ok", report.ok()}, {"diagnostics", list}});
}

}  // namespace mbcosim::cli
