#include "elements/ports/mapping_file.h"

#include <cmath>
#include <sstream>

namespace mbcosim {

namespace {

constexpr int kMostRows = 300000;

[[noreturn]] void refuse(Card& card, const std::string& name, const std::string& what) {
  card.fail("mapping file \"" + name + "\": " + what);
}

int count_rows(Card& card, const std::string& name, const std::vector<double>& numbers, bool sparse,
               int columns, int step) {
  double rows = 0;
  if (!sparse) {
    if (numbers.size() % columns != 0)
      refuse(card, name,
             std::to_string(numbers.size()) + " numbers do not fill rows of " +
                 std::to_string(columns));
    return static_cast<int>(numbers.size() / columns);
  }
  for (std::size_t k = 0; k < numbers.size(); k += 3) rows = std::max(rows, numbers[k]);
  if (!(rows <= kMostRows)) refuse(card, name, "a row beyond " + std::to_string(kMostRows));
  return (static_cast<int>(rows) + step - 1) / step * step;
}

/// Of an entry that is given twice, the last counts.
void fill_sparse(Card& card, const std::string& name, const std::vector<double>& numbers,
                 MappingMatrix& H) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < numbers.size(); k += 3) {
    const double i = numbers[k], j = numbers[k + 1];
    if (!(i >= 1 && i <= H.rows() && j >= 1 && j <= H.cols() && i == std::floor(i) &&
          j == std::floor(j)))
      refuse(card, name,
             "entry " + std::to_string(k / 3 + 1) + " lies outside of " + std::to_string(H.rows()) +
                 " by " + std::to_string(H.cols()));
    entries.emplace_back(static_cast<int>(i) - 1, static_cast<int>(j) - 1, numbers[k + 2]);
  }
  H.setFromTriplets(entries.begin(), entries.end(), [](double, double later) { return later; });
}

void fill_full(Card& card, const std::string& name, const std::vector<double>& numbers,
               MappingMatrix& H) {
  if (numbers.size() != static_cast<std::size_t>(H.rows()) * H.cols())
    refuse(card, name,
           "the matrix must be " + std::to_string(H.rows()) + " by " + std::to_string(H.cols()) +
               ", found " + std::to_string(numbers.size()) + " numbers");
  const double* value = numbers.data();
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    H.startVec(i);
    for (Eigen::Index j = 0; j < H.cols(); ++j, ++value)
      if (*value != 0) H.insertBack(i, j) = *value;
  }
  H.finalize();
}

}  // namespace

std::vector<double> read_mapping_numbers(Card& card, const std::string& text, std::size_t* lines) {
  std::vector<double> numbers;
  std::istringstream in(text);
  *lines = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    const std::size_t before = numbers.size();
    for (std::string word; words >> word;) {
      char* end = nullptr;
      numbers.push_back(std::strtod(word.c_str(), &end));
      if (*end != 0 || !std::isfinite(numbers.back()))
        card.fail("mapping file: \"" + word.substr(0, 40) + "\" is no number");
    }
    *lines += numbers.size() > before ? 1 : 0;
  }
  return numbers;
}

MappingMatrix read_mapping_file(Card& card, int rows, int columns, int step) {
  const bool sparse = card.required("mapping", {"full mapping file", "sparse mapping file"}) == 1;
  const double threshold = card.keyword("threshold") ? card.real("threshold") : 0;
  if (!(threshold >= 0)) card.fail("the threshold of a mapping must not be negative");
  std::string name;
  std::size_t lines = 0;
  const std::vector<double> numbers =
      read_mapping_numbers(card, card.file_contents("mapping file", &name), &lines);
  if (sparse && numbers.size() != 3 * lines)
    refuse(card, name, "each line must have row, column and value");
  if (rows < 0) rows = count_rows(card, name, numbers, sparse, columns, step);
  if (rows < step || rows % step != 0 || rows > kMostRows)
    refuse(card, name,
           step == 3 ? "the matrix must have three rows for each mapped point"
                     : "the matrix must have a row for each mode");
  MappingMatrix H(rows, columns);
  if (sparse)
    fill_sparse(card, name, numbers, H);
  else
    fill_full(card, name, numbers, H);
  H.prune([&](Eigen::Index, Eigen::Index, double x) { return std::abs(x) > threshold; });
  return H;
}

}  // namespace mbcosim
