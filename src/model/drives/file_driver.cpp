#include "model/drives/file_driver.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "model/context.h"
#include "model/diagnostic.h"
#include "model/end_of_run.h"
#include "model/state.h"
#include "model/text.h"

namespace mbcosim {

int SampleTable::row_before(double t) const {
  const int last = rows() - 1;
  if (times.empty())
    return static_cast<int>(std::clamp(std::floor((t - t0) / dt), 0.0, static_cast<double>(last)));
  const auto k = std::upper_bound(times.begin(), times.end(), t) - times.begin();
  return std::clamp(static_cast<int>(k) - 1, 0, last);
}

void TableDriver::check(double t) const {
  if (t < table_.time(0) && options_.bail_lower)
    throw EndOfRun("file driver: time " + std::to_string(t) +
                   " is before the first sample (bailout)");
  if (t > table_.time(table_.rows() - 1) && options_.bail_upper)
    throw EndOfRun("file driver: time " + std::to_string(t) +
                   " is after the last sample (bailout)");
}

void TableWatch::advance(const EvalContext& context, State&, bool) const {
  table_->check(context.time);
}

double TableDriver::value(const EvalContext&, int channel, double t) const {
  check(t);
  const int last = table_.rows() - 1;
  const double first_time = table_.time(0), last_time = table_.time(last);
  const bool edge_is_outside = !table_.times.empty();
  if (t < first_time || (edge_is_outside && t == first_time))
    return options_.pad_zeros ? 0.0 : sample(0, channel);
  if (t > last_time || (edge_is_outside && t == last_time))
    return options_.pad_zeros ? 0.0 : sample(last, channel);
  const int k = table_.row_before(t);
  const double y = sample(k, channel);
  if (!options_.linear || k == last) return y;
  const double tk = table_.time(k);
  return y + (sample(k + 1, channel) - y) * (t - tk) / (table_.time(k + 1) - tk);
}

double StreamDriver::value(const EvalContext& context, int channel, double) const {
  return context.state->memory[memory_ + channel];
}

namespace {

constexpr std::string_view kBlanks = " \t\r,";

/// Text after `key` and a colon in a comment line; empty when it is another comment.
std::string header_value(std::string_view comment, std::string_view key) {
  comment = trimmed(comment.substr(1), kBlanks);
  if (comment.substr(0, key.size()) != key) return {};
  comment = trimmed(comment.substr(key.size()), kBlanks);
  return comment.empty() || comment[0] != ':' ? std::string()
                                              : std::string(trimmed(comment.substr(1), kBlanks));
}

/// Appends the `columns` numbers that a line has; what is wrong when there are others.
std::string append_row(std::string_view line, int columns, std::vector<double>& values) {
  const std::string expected = std::to_string(columns) + " numbers expected";
  for (int k = 0; k < columns; ++k) {
    line = trimmed(line, kBlanks);
    if (!line.empty() && line[0] == '+') line.remove_prefix(1);
    double v = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), v);
    if (error != std::errc()) return expected;
    const std::string_view number = line.substr(0, end - line.data());
    if (!std::isfinite(v)) return '"' + std::string(number) + "\" is no finite number";
    values.push_back(v);
    line.remove_prefix(number.size());
  }
  constexpr std::size_t kShown = 40;
  line = trimmed(line, kBlanks);
  if (line.empty() || line[0] == '#') return "";
  return expected + ", then comes \"" + std::string(line.substr(0, kShown)) + '"';
}

}  // namespace

SampleText parse_samples(const std::string& text, int columns) {
  SampleText r;
  std::string_view rest = text;
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = trimmed(rest.substr(0, end), kBlanks);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.empty()) continue;
    if (line[0] == '#') {
      if (std::string v = header_value(line, "initial time"); !v.empty()) r.initial_time = v;
      if (std::string v = header_value(line, "time step"); !v.empty()) r.time_step = v;
      continue;
    }
    if (const std::string wrong = append_row(line, columns, r.values); !wrong.empty()) {
      r.error = "line " + std::to_string(number) + ": " + wrong;
      return r;
    }
    ++r.rows;
  }
  return r;
}

}  // namespace mbcosim
