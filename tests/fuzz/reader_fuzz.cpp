/// libFuzzer target: bytes in, a model or diagnostics out, never anything else.
///
/// The input is a deck, followed by the files that it may read: a line `%%file NAME` begins one.
/// seeds.py writes the same form.
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>

#include "input/sources.h"
#include "simulation/simulation.h"

namespace {

using namespace mbcosim;

constexpr std::string_view kSeparator = "\n%%file ";

std::map<std::string, std::string> split(std::string_view bytes) {
  std::map<std::string, std::string> files;
  std::string name = "deck.mbd";
  while (true) {
    const std::size_t end = bytes.find(kSeparator);
    files[name] = bytes.substr(0, end);
    if (end == std::string_view::npos) return files;
    bytes.remove_prefix(end + kSeparator.size());
    const std::size_t line = bytes.find('\n');
    if (line == std::string_view::npos) return files;
    name = bytes.substr(0, line);
    bytes.remove_prefix(line + 1);
  }
}

/// Small enough that a short deck cannot unroll to minutes of honest work: what is sought is work
/// that the limits do not see.
Limits fuzz_limits() {
  Limits limits;
  limits.deck_bytes = 1 << 20;
  limits.include_count = 100;
  limits.statements = 5000;
  limits.loop_iterations = 1000;
  limits.unknowns = 100'000;
  return limits;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const BundleSource files(split({reinterpret_cast<const char*>(data), size}));
  const LoadReport report = load_deck(files, "deck.mbd", fuzz_limits());
  bool refused = false;
  for (const Diagnostic& d : report.diagnostics) {
    refused |= d.severity == Severity::error;
    if (d.text().empty() || d.code == "internal") std::abort();
  }
  if (refused == (report.model != nullptr)) std::abort();
  return 0;
}
