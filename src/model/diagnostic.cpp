#include "model/diagnostic.h"

#include <algorithm>

namespace mbcosim {

namespace {

const char* severity_name(Severity s) {
  switch (s) {
    case Severity::error:
      return "error";
    case Severity::warning:
      return "warning";
    case Severity::note:
      return "note";
  }
  return "error";
}

/// The blanks that put a caret below `column`; tabs stay tabs, so that both lines indent alike.
std::string caret_indent(const std::string& line, int column) {
  std::string indent;
  const int n = std::min(column - 1, static_cast<int>(line.size()));
  for (int i = 0; i < n; ++i) indent += line[i] == '\t' ? '\t' : ' ';
  return indent;
}

}  // namespace

std::string Diagnostic::text() const {
  std::string r = file;
  if (line > 0) r += ":" + std::to_string(line) + ":" + std::to_string(column);
  if (!r.empty()) r += ": ";
  r += std::string(severity_name(severity)) + ": " + message + "\n";
  if (!source_line.empty()) {
    r += "  " + source_line + "\n  " + caret_indent(source_line, column) + "^";
    const int room = static_cast<int>(source_line.size()) - column;
    if (length > 1 && room > 0) r += std::string(std::min(length - 1, room), '~');
    r += "\n";
  }
  if (!hint.empty()) r += "  hint: " + hint + "\n";
  for (const std::string& t : trail) r += "  " + t + "\n";
  return r;
}

}  // namespace mbcosim
