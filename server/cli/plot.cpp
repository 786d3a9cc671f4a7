/// `mbcosim plot`: curves of a run's result files.
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "cli/chart.h"
#include "cli/commands.h"
#include "cli/deck_report.h"
#include "cli/result_table.h"

namespace mbcosim::cli {
namespace {

/// Columns of a table that a word stands for, from 1; the label does not count.
using Words = std::map<std::string, std::vector<int>>;

constexpr int kMatrixColumns = 9, kAngles = 3;

/// Of nodes with three numbers for their orientation: angles, or the rotation vector.
const Words& node_words() {
  static const Words words = {
      {"x", {1}},       {"y", {2}},       {"z", {3}},       {"e1", {4}},        {"e2", {5}},
      {"e3", {6}},      {"vx", {7}},      {"vy", {8}},      {"vz", {9}},        {"wx", {10}},
      {"wy", {11}},     {"wz", {12}},     {"ax", {13}},     {"ay", {14}},       {"az", {15}},
      {"X", {1, 2, 3}}, {"E", {4, 5, 6}}, {"V", {7, 8, 9}}, {"W", {10, 11, 12}}};
  return words;
}

/// Of nodes with nine.
const Words& node_words_beside_matrix() {
  static const Words words = [] {
    Words shifted;
    for (const auto& [name, columns] : node_words()) {
      if (name[0] == 'e' || name[0] == 'E') continue;
      for (const int column : columns)
        shifted[name].push_back(column > kAngles ? column + kMatrixColumns - kAngles : column);
    }
    return shifted;
  }();
  return words;
}

const Words& joint_words() {
  static const Words words = {
      {"fx", {1}},      {"fy", {2}},      {"fz", {3}},      {"mx", {4}},
      {"my", {5}},      {"mz", {6}},      {"Fx", {7}},      {"Fy", {8}},
      {"Fz", {9}},      {"Mx", {10}},     {"My", {11}},     {"Mz", {12}},
      {"f", {1, 2, 3}}, {"m", {4, 5, 6}}, {"F", {7, 8, 9}}, {"M", {10, 11, 12}}};
  return words;
}

Error plot_error(std::string message) {
  return make_error(ErrorKind::argument, "", std::move(message));
}

/// Columns by a word, or by a number.
Result<std::vector<int>> columns_of(const std::string& word, const Words& words) {
  if (const auto found = words.find(word); found != words.end()) return found->second;
  int number = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (code == std::errc() && end == word.data() + word.size() && number > 0)
    return std::vector<int>{number};
  std::string known;
  for (const auto& [name, columns] : words) known += " " + name;
  return plot_error("\"" + word + "\" is no quantity; there are" + known +
                    ", and the numbers of columns after the label, from 1");
}

std::string labels(const ResultTable& table) {
  std::string text;
  for (const auto& [label, rows] : table.rows) text += " " + std::to_string(label);
  return text.empty() ? " none" : text;
}

std::string name_of(int column, const Words& words) {
  for (const auto& [name, columns] : words)
    if (columns.size() == 1 && columns.front() == column) return name;
  return "column " + std::to_string(column);
}

Result<Curve> curve_of(const ResultTable& table, const std::vector<double>& times, int label,
                       int column, std::string name) {
  const auto rows = table.rows.find(label);
  if (rows == table.rows.end())
    return plot_error(table.path + " has no label " + std::to_string(label) + "; there are" +
                      labels(table));
  Curve curve;
  curve.name = std::move(name);
  for (std::size_t k = 0; k < rows->second.size(); ++k) {
    const std::vector<double>& row = rows->second[k];
    if (static_cast<int>(row.size()) < column)
      return plot_error(table.path + ": the rows of label " + std::to_string(label) + " have " +
                        std::to_string(row.size()) + " columns, not " + std::to_string(column));
    if (k >= times.size()) break;
    curve.x.push_back(times[k]);
    curve.y.push_back(row[static_cast<std::size_t>(column) - 1]);
  }
  return curve;
}

const Words& words_of(const std::string& prefix, const CurveRequest& request) {
  static const Words none;
  if (request.ending == "jnt") return joint_words();
  if (request.ending != "mov") return none;
  const auto orientations = read_orientations(prefix);
  const auto found = orientations.find(request.label);
  const bool matrix = found != orientations.end() && found->second == "mat";
  return matrix ? node_words_beside_matrix() : node_words();
}

/// Adds the curves of one request.
Status add_curves(const std::string& prefix, const CurveRequest& request,
                  const std::vector<double>& times, std::vector<Curve>& curves) {
  const Words& words = words_of(prefix, request);
  const auto columns = columns_of(request.quantity, words);
  if (!columns) return columns.error();
  const auto table = read_table(prefix, request.ending);
  if (!table) return table.error();
  for (const int column : *columns) {
    const std::string what = request.ending == "mov"   ? "node "
                             : request.ending == "jnt" ? "joint "
                                                       : request.ending + " ";
    auto curve = curve_of(*table, times, request.label, column,
                          what + std::to_string(request.label) + " " + name_of(column, words));
    if (!curve) return curve.error();
    curves.push_back(std::move(*curve));
  }
  return ok();
}

int terminal_columns() {
  winsize size{};
  constexpr int kUsual = 80;
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

}  // namespace

int plot(const PlotCommand& command) {
  const auto fail = [](const Error& error) {
    print_error(error, stderr);
    return exit_code_of(error);
  };
  const auto times = read_times(command.prefix);
  if (!times) return fail(times.error());
  std::vector<Curve> curves;
  for (const CurveRequest& request : command.curves)
    if (const auto added = add_curves(command.prefix, request, *times, curves); !added)
      return fail(added.error());
  const auto has_point = [](const Curve& curve) {
    return std::any_of(curve.y.begin(), curve.y.end(), [](double y) { return std::isfinite(y); });
  };
  if (std::none_of(curves.begin(), curves.end(), has_point))
    return fail(plot_error(
        times->empty() ? "\"" + command.prefix +
                             ".out\" has no line of a step, thus no time to draw over; does the "
                             "deck say `output: none`?"
                       : "there is nothing to draw: no value is a finite number"));
  constexpr const char* kTime = "time [s]";
  constexpr int kLines = 20;
  if (command.picture.empty()) {
    std::fputs(text_chart(curves, kTime, terminal_columns(), kLines).c_str(), stdout);
    return kDone;
  }
  const auto drawn = picture(curves, kTime, command.prefix, command.picture);
  return drawn ? static_cast<int>(kDone) : static_cast<int>(fail(drawn.error()));
}

}  // namespace mbcosim::cli
