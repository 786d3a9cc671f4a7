#include "reduction/fe_model.h"

#include <charconv>
#include <cmath>

#include "model/text.h"
#include "reduction/error.h"

namespace mbcosim {

namespace {

constexpr std::size_t kShown = 100;  ///< characters of what messages quote, and of labels
constexpr double kFarthest = 1e30;   ///< [m] its products with others are finite
constexpr const char* kComponents[] = {"ux", "uy", "uz", "rx", "ry", "rz"};

constexpr std::string_view kBlanks = " \t\r\"";

/// Rows of comma-separated cells; comments (`#`), empty lines and a heading `label,...` are
/// skipped.
class Table {
 public:
  Table(std::string name, std::string_view text) : name_(std::move(name)), rest_(text) {}

  /// The next row of `cells` cells; false at the end.
  bool next(std::size_t cells, std::vector<std::string>& row) {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      const std::string_view line = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      split(line.substr(0, line.find('#')), row);
      if (row.size() == 1 && row[0].empty()) continue;
      if (number_ == 1 && (row[0] == "label" || row[0] == "node")) continue;
      if (row.size() != cells)
        fail(std::to_string(cells) + " values expected, got " + std::to_string(row.size()));
      return true;
    }
    return false;
  }
  [[noreturn]] void fail(const std::string& message) const {
    refuse_reduction(name_ + ":" + std::to_string(number_) + ": " + message);
  }
  double real(const std::string& cell) const {
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
      fail("a number expected, got `" + cell.substr(0, kShown) + "`");
    if (std::abs(value) > kFarthest)
      fail("a coordinate larger than anybody can compute with (1e30): " + cell.substr(0, kShown));
    return value;
  }

 private:
  static void split(std::string_view line, std::vector<std::string>& row) {
    row.clear();
    for (std::size_t at = 0; at <= line.size();) {
      const std::size_t end = std::min(line.find(',', at), line.size());
      row.emplace_back(trimmed(line.substr(at, end - at), kBlanks));
      at = end + 1;
    }
  }
  std::string name_;
  std::string_view rest_;
  long number_ = 0;
};

void read_nodes(const std::string& text, FeModel& model) {
  Table table("nodes", text);
  std::vector<std::string> row;
  std::vector<double> numbers;
  while (table.next(4, row)) {
    if (row[0].empty() || row[0].size() > kShown ||
        row[0].find_first_of(" \t") != std::string::npos)
      table.fail("a label of at most 100 characters, without blanks, expected");
    if (!model.index.emplace(row[0], static_cast<int>(model.labels.size())).second)
      table.fail("node " + row[0] + " is there twice");
    model.labels.push_back(row[0]);
    for (int a = 1; a <= 3; ++a) numbers.push_back(table.real(row[a]));
  }
  if (model.labels.empty()) refuse_reduction("nodes: no node found");
  model.positions = Eigen::Map<const MatX>(numbers.data(), 3, numbers.size() / 3);
}

void read_dofs(const std::string& text, FeModel& model) {
  Table table("dofs", text);
  std::vector<std::string> row;
  while (table.next(2, row)) {
    const auto found = model.index.find(row[0]);
    if (found == model.index.end()) table.fail("there is no node " + row[0]);
    const double component = table.real(row[1]);
    if (component != std::floor(component) || component < 1 || component > 6)
      table.fail("the component must be 1 to 6, got " + row[1]);
    model.dofs.push_back({found->second, static_cast<int>(component) - 1});
  }
}

void read_supports(const std::string& text, FeModel& model) {
  Table table("supports", text);
  std::vector<std::string> row;
  while (table.next(2, row)) {
    const auto found = model.index.find(row[0]);
    if (found == model.index.end()) table.fail("there is no node " + row[0].substr(0, kShown));
    for (const int component : parse_components(row[1])) {
      const int dof = model.row(found->second, component);
      if (dof >= 0) model.supported[dof] = 1;
    }
  }
}

/// Rows of nodes, and that everything fits together.
void complete(FeModel& model) {
  if (model.mass.rows() != model.stiffness.rows())
    refuse_reduction("the mass matrix has order " + std::to_string(model.mass.rows()) +
                     ", the stiffness matrix " + std::to_string(model.stiffness.rows()));
  const std::size_t nodes = model.labels.size();
  const bool standard = model.dofs.empty();
  if (standard)
    for (std::size_t k = 0; k < 6 * nodes; ++k)
      model.dofs.push_back({static_cast<int>(k / 6), static_cast<int>(k % 6)});
  if (model.mass.rows() != model.rows())
    refuse_reduction("the matrices have order " + std::to_string(model.mass.rows()) + ", " +
                         (standard ? "6 rows for each of " + std::to_string(nodes) + " nodes make "
                                   : std::string("the table of degrees of freedom has ")) +
                         std::to_string(model.rows()),
                     standard ? "give a table of degrees of freedom" : "");
  model.row_of.assign(nodes, {-1, -1, -1, -1, -1, -1});
  for (int r = 0; r < model.rows(); ++r) {
    int& row = model.row_of[model.dofs[r].node][model.dofs[r].component];
    if (row >= 0) refuse_reduction(model.dof_text(r) + " has two rows");
    row = r;
  }
  model.supported.assign(model.rows(), 0);
}

}  // namespace

int FeModel::node(const std::string& label) const {
  const auto found = index.find(label);
  if (found == index.end()) refuse_reduction("the model has no node " + label);
  return found->second;
}

int FeModel::row(int node, int component) const { return row_of[node][component]; }

std::vector<int> FeModel::rows_of(int node) const {
  std::vector<int> found;
  for (const int row : row_of[node])
    if (row >= 0) found.push_back(row);
  return found;
}

std::string FeModel::dof_text(int row) const {
  return "node " + labels[dofs[row].node] + ", " + kComponents[dofs[row].component];
}

MatX FeModel::rigid_shapes(const Vec3& point) const {
  MatX shapes = MatX::Zero(rows(), 6);
  for (int r = 0; r < rows(); ++r) {
    const int c = dofs[r].component;
    shapes(r, c) = 1;
    if (c > 2) continue;
    const Mat3 arm = cross<double>(Vec3(positions.col(dofs[r].node)) - point);
    shapes.row(r).tail<3>() = -arm.row(c);
  }
  return shapes;
}

std::vector<int> parse_components(const std::string& digits) {
  std::vector<int> components;
  for (const char c : digits) {
    if (c < '1' || c > '6')
      refuse_reduction("components are digits from 1 to 6, got `" + digits + "`");
    components.push_back(c - '1');
  }
  if (components.empty()) refuse_reduction("components are missing");
  return components;
}

FeModel make_fe_model(const FeModelFiles& files) {
  FeModel model;
  read_nodes(files.nodes, model);
  read_dofs(files.dofs, model);
  model.mass = parse_matrix_market("mass", files.mass);
  model.stiffness = parse_matrix_market("stiffness", files.stiffness);
  complete(model);
  read_supports(files.supports, model);
  return model;
}

FeModel make_fe_model(std::vector<std::string> labels, MatX positions, std::vector<FeDof> dofs,
                      SparseMatrix mass, SparseMatrix stiffness) {
  FeModel model;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (!model.index.emplace(labels[k], static_cast<int>(k)).second)
      refuse_reduction("node " + labels[k] + " is there twice");
  model.labels = std::move(labels);
  model.positions = std::move(positions);
  model.dofs = std::move(dofs);
  model.mass = std::move(mass);
  model.stiffness = std::move(stiffness);
  complete(model);
  return model;
}

}  // namespace mbcosim
