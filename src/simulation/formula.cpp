#include "simulation/formula.h"

#include "input/run_strings.h"
#include "input/sources.h"

namespace mbcosim {

namespace {

Error wrong(const std::string& text, const std::string& why) {
  return make_error(ErrorKind::argument, "BAD_FORMULA",
                    "expression \"" + text.substr(0, 200) + "\": " + why);
}

}  // namespace

Result<ExpressionPtr> compile_formula(const std::string& text,
                                      const std::vector<std::string>& names) {
  constexpr std::size_t kMostNames = 12;
  if (names.size() > kMostNames)
    return wrong(text, "at most 12 variables are allowed, got " + std::to_string(names.size()));
  const BundleSource none(std::map<std::string, std::string>{});
  Reading reading(none, Limits{});
  try {
    const int file = reading.add_text("expression", text);
    ExpressionPtr compiled =
        compile_expression(reading, text, names, reading.span(file, 0, text.size()));
    reading.bind_strings();
    if (reading.errors() == 0) return compiled;
    for (const Diagnostic& d : reading.diagnostics())
      if (d.severity == Severity::error) return wrong(text, d.message);
    return wrong(text, "it cannot be read");
  } catch (const std::exception& error) {
    return wrong(text, error.what());
  }
}

}  // namespace mbcosim
