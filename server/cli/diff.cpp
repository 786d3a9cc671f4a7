/// `mbcosim diff`: compares the results of two runs.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/commands.h"
#include "cli/deck_report.h"
#include "cli/result_table.h"

namespace mbcosim::cli {
namespace {

/// The largest difference of a column, and where it is.
struct Worst {
  double difference = 0, scale = 0;  ///< scale: largest value of the column in the first run
  int label = 0, column = 0;
  std::size_t record = 0;

  double relative() const {
    return difference == 0 ? 0 : scale > 0 ? difference / scale : HUGE_VAL;
  }
};

/// `period`: of angles, of which 180 and -180 are the same; infinite: of no angle.
double distance(double a, double b, double period) {
  if (std::isnan(a) && std::isnan(b)) return 0;
  if (std::isnan(a) || std::isnan(b)) return HUGE_VAL;
  const double straight = a == b ? 0 : std::abs(a - b);  // equal infinities, too
  return straight > 0.5 * period ? std::abs(std::remainder(a - b, period)) : straight;
}

using Rows = std::vector<std::vector<double>>;

Worst compare_column(const Rows& a, const Rows& b, std::size_t column, double period) {
  Worst worst;
  for (std::size_t k = 0; k < a.size(); ++k) {
    worst.scale = std::max(worst.scale, std::abs(a[k][column]));
    const double d = distance(a[k][column], b[k][column], period);
    if (d > worst.difference) worst.difference = d, worst.record = k;
  }
  return worst;
}

bool same_shape(const Rows& a, const Rows& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(),
                    [](const auto& x, const auto& y) { return x.size() == y.size(); });
}

class Comparison {
 public:
  Comparison(const DiffCommand& command)
      : command_(command), orientations_(read_orientations(command.first)) {}

  Status table(const std::string& ending) {
    const auto a = read_table(command_.first, ending), b = read_table(command_.second, ending);
    if (!a) return a.error();
    if (!b) return b.error();
    Worst worst;
    const int before = said_;
    for (const auto& [label, rows] : a->rows) {
      const auto other = b->rows.find(label);
      if (other == b->rows.end() || !same_shape(rows, other->second)) {
        say(ending, label,
            other == b->rows.end() ? "is missing in the second"
                                   : "differs in the number of records");
        continue;
      }
      compare(rows, other->second, label, ending == "mov" && has_angles(label), worst);
    }
    for (const auto& [label, rows] : b->rows)
      if (!a->rows.contains(label)) say(ending, label, "is missing in the first");
    if (said_ == before || worst.difference > 0) report(ending, worst);
    return ok();
  }

  void missing(const std::string& ending, const char* where) {
    differ_ = true;
    std::printf("%-4s is missing in the %s\n", ending.c_str(), where);
  }
  bool differ() const { return differ_; }

 private:
  void say(const std::string& ending, int label, const char* what) {
    differ_ = true;
    ++said_;
    std::printf("%-4s label %d %s\n", ending.c_str(), label, what);
  }
  bool has_angles(int label) const {
    const auto found = orientations_.find(label);
    return found != orientations_.end() && found->second.starts_with("euler");
  }
  /// `angles`: the rows are a node's, with Euler angles [deg] in the columns 4 to 6.
  void compare(const Rows& a, const Rows& b, int label, bool angles, Worst& worst) {
    for (std::size_t column = 0; !a.empty() && column < a.front().size(); ++column) {
      const bool angle = angles && column >= 3 && column < 6;
      Worst here = compare_column(a, b, column, angle ? 360 : HUGE_VAL);
      if (here.difference <= command_.absolute) continue;
      here.label = label;
      here.column = static_cast<int>(column) + 1;
      if (here.relative() > worst.relative()) worst = here;
    }
  }
  void report(const std::string& ending, const Worst& worst) {
    const bool beyond = worst.relative() > command_.relative;
    differ_ = differ_ || beyond;
    if (worst.difference == 0)
      std::printf("%-4s same\n", ending.c_str());
    else
      std::printf("%-4s %s: %.3g in label %d, column %d, record %zu; %.3g of the column's size\n",
                  ending.c_str(), beyond ? "differs" : "within tolerance", worst.difference,
                  worst.label, worst.column, worst.record, worst.relative());
  }

  const DiffCommand& command_;
  const std::map<int, std::string> orientations_;
  bool differ_ = false;
  int said_ = 0;  ///< labels that one side lacks, or has with other records
};

}  // namespace

int diff(const DiffCommand& command) {
  const std::vector<std::string> a = table_endings(command.first),
                                 b = table_endings(command.second);
  for (const auto& [endings, prefix] : {std::pair(&a, &command.first), {&b, &command.second}})
    if (endings->empty()) {
      print_error(no_tables(*prefix), stderr);
      return kRefused;
    }
  Comparison comparison(command);
  for (const std::string& ending : a) {
    if (std::find(b.begin(), b.end(), ending) == b.end()) {
      comparison.missing(ending, "second");
      continue;
    }
    if (const auto done = comparison.table(ending); !done) {
      print_error(done.error(), stderr);
      return exit_code_of(done.error());
    }
  }
  for (const std::string& ending : b)
    if (std::find(a.begin(), a.end(), ending) == a.end()) comparison.missing(ending, "first");
  return comparison.differ() ? kDiffer : kDone;
}

}  // namespace mbcosim::cli
