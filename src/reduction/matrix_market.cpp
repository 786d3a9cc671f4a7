#include "reduction/matrix_market.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <vector>

#include "model/registry.h"
#include "reduction/error.h"

namespace mbcosim {

namespace {

constexpr double kAsymmetry = 1e-10;  ///< relative to the largest entry
constexpr double kLargest = 1e60;     ///< whose products with others are finite
constexpr std::string_view kBetween = " \t\r";
constexpr std::size_t kShortestEntry = 6;  ///< bytes of "1 1 1\n"

class Reader {
 public:
  Reader(const std::string& name, std::string_view text) : name_(name), rest_(text) {}

  SparseMatrix read() {
    read_banner();
    read_sizes();
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(symmetric_ ? 2 * count_ : count_);
    for (std::size_t k = 0; k < count_; ++k) read_entry(entries);
    if (next_line()) fail("more entries than the " + std::to_string(count_) + " announced");
    SparseMatrix matrix(order_, order_);
    matrix.setFromTriplets(entries.begin(), entries.end());
    if (!symmetric_) check_symmetry(matrix);
    return matrix;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    refuse_reduction(name_ + ":" + std::to_string(number_) + ": " + message);
  }

  /// The next line with content; false at the end.
  bool next_line() {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      line_ = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      const std::size_t first = line_.find_first_not_of(" \t\r");
      if (first != std::string_view::npos && (line_[first] != '%' || number_ == 1)) {
        line_.remove_prefix(first);
        return true;
      }
    }
    return false;
  }

  void read_banner() {
    if (!next_line() || normalized(line_.substr(0, 14)) != "%%matrixmarket")
      fail("`%%MatrixMarket` expected on the first line");
    const std::string banner = normalized(line_);
    if (banner.find("matrixcoordinate") == std::string::npos)
      fail("`matrix coordinate` expected in the first line");
    if (banner.find("real") == std::string::npos && banner.find("integer") == std::string::npos)
      fail("a matrix of real or integer numbers expected");
    symmetric_ = banner.ends_with("symmetric") && !banner.ends_with("skew-symmetric");
    if (!symmetric_ && !banner.ends_with("general"))
      fail("a `symmetric` or `general` matrix expected");
  }

  void read_sizes() {
    if (!next_line()) fail("the line of sizes is missing");
    const long long rows = integer("number of rows"), columns = integer("number of columns"),
                    count = integer("number of entries");
    end_of_line();
    if (rows != columns)
      fail("the matrix is not square: " + std::to_string(rows) + " x " + std::to_string(columns));
    if (rows < 1 || rows > 50'000'000) fail("order " + std::to_string(rows) + " is not accepted");
    if (count < 0) fail("the number of entries is negative: " + std::to_string(count));
    if (static_cast<std::size_t>(count) > rest_.size() / kShortestEntry + 1)
      fail("the file is too short for " + std::to_string(count) + " entries");
    order_ = static_cast<int>(rows);
    count_ = static_cast<std::size_t>(count);
  }

  void read_entry(std::vector<Eigen::Triplet<double>>& entries) {
    if (!next_line()) fail("the file ends before all entries");
    const long long i = integer("row"), j = integer("column");
    const double value = real();
    end_of_line();
    if (i < 1 || i > order_ || j < 1 || j > order_)
      fail("entry (" + std::to_string(i) + ", " + std::to_string(j) + ") lies outside the matrix");
    if (!(std::abs(value) <= kLargest))
      fail("the value is not finite, or larger than anybody can compute with (1e60)");
    if (symmetric_ && i != j) {
      (i > j ? below_ : above_) = true;
      if (below_ && above_)
        fail(
            "a `symmetric` matrix has the entries of one triangle only, this one is in the other "
            "than those before: write `general`, or leave one triangle out");
    }
    entries.emplace_back(static_cast<int>(i - 1), static_cast<int>(j - 1), value);
    if (symmetric_ && i != j)
      entries.emplace_back(static_cast<int>(j - 1), static_cast<int>(i - 1), value);
  }

  void skip_blanks() {
    line_.remove_prefix(std::min(line_.find_first_not_of(" \t"), line_.size()));
    if (!line_.empty() && line_[0] == '+') line_.remove_prefix(1);
  }
  long long integer(const char* what) {
    skip_blanks();
    long long value = 0;
    const auto [end, error] = std::from_chars(line_.data(), line_.data() + line_.size(), value);
    line_.remove_prefix(end - line_.data());
    if (error != std::errc() || (!line_.empty() && kBetween.find(line_[0]) == std::string::npos))
      fail(std::string(what) + " expected");
    return value;
  }
  /// Fortran writes exponents with D, too.
  double real() {
    skip_blanks();
    std::string text(line_.substr(0, line_.find_first_of(kBetween)));
    line_.remove_prefix(text.size());
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == 'd' || c == 'D'; }, 'e');
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) fail("a number expected");
    return value;
  }
  void end_of_line() {
    if (line_.find_first_not_of(kBetween) != std::string::npos)
      fail("nothing is expected after the numbers");
  }

  void check_symmetry(const SparseMatrix& matrix) const {
    double largest = 0, difference = 0;
    for (int k = 0; k < matrix.outerSize(); ++k)
      for (SparseMatrix::InnerIterator it(matrix, k); it; ++it)
        largest = std::max(largest, std::abs(it.value()));
    const SparseMatrix other = SparseMatrix(matrix.transpose()) - matrix;
    for (int k = 0; k < other.outerSize(); ++k)
      for (SparseMatrix::InnerIterator it(other, k); it; ++it)
        difference = std::max(difference, std::abs(it.value()));
    if (difference > kAsymmetry * largest)
      refuse_reduction(name_ + ": the matrix is not symmetric: entries differ by " +
                       std::to_string(difference / largest) + " of the largest");
  }

  std::string name_;
  std::string_view rest_, line_;
  long number_ = 0;
  bool symmetric_ = false;
  bool below_ = false, above_ = false;  ///< has entries there
  int order_ = 0;
  std::size_t count_ = 0;
};

}  // namespace

SparseMatrix parse_matrix_market(const std::string& name, std::string_view text) {
  return Reader(name, text).read();
}

std::string write_matrix_market(const SparseMatrix& matrix) {
  std::string entries;
  long count = 0;
  char line[96];
  for (int k = 0; k < matrix.outerSize(); ++k)
    for (SparseMatrix::InnerIterator it(matrix, k); it; ++it) {
      if (it.row() < it.col()) continue;
      std::snprintf(line, sizeof line, "%d %d %.17g\n", static_cast<int>(it.row()) + 1,
                    static_cast<int>(it.col()) + 1, it.value());
      entries += line;
      ++count;
    }
  const std::string order = std::to_string(matrix.rows());
  return "%%MatrixMarket matrix coordinate real symmetric\n" + order + " " + order + " " +
         std::to_string(count) + "\n" + entries;
}

}  // namespace mbcosim
