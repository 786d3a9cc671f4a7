/// Reader and writer of the text form of FEM data files.

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "elements/modal/fem_data.h"
#include "model/text.h"

namespace mbcosim {

namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

bool is_comment(std::string_view line) { return trimmed(line).substr(0, 2) == "**"; }

template <class T>
bool read_number(std::string_view token, T& value) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-' && token[1] != '+')
    token.remove_prefix(1);
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  return error == std::errc() && end == token.data() + token.size();
}

/// Walks over the text by lines and by words, counting lines.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}
  bool at_end() const { return pos_ >= text_.size(); }
  int line() const { return line_; }  ///< of the word or line read last
  std::size_t remaining() const { return text_.size() - pos_; }
  std::string_view peek_line() const {
    const std::size_t end = text_.find('\n', pos_);
    return text_.substr(pos_, end == std::string_view::npos ? std::string_view::npos : end - pos_);
  }
  std::string_view next_line() {
    const std::string_view line = peek_line();
    line_ = next_;
    pos_ = std::min(pos_ + line.size() + 1, text_.size());
    ++next_;
    return line;
  }
  /// Next word separated by blanks or line ends; empty at the end, and before a line that starts
  /// with `**`.
  std::string_view next_word() {
    while (pos_ < text_.size() && (is_blank(text_[pos_]) || text_[pos_] == '\n')) {
      if (text_[pos_] == '\n') ++next_;
      ++pos_;
    }
    line_ = next_;
    std::size_t end = pos_;
    while (end < text_.size() && !is_blank(text_[end]) && text_[end] != '\n') ++end;
    const std::string_view word = text_.substr(pos_, end - pos_);
    if (word.substr(0, 2) == "**") return {};
    pos_ = end;
    return word;
  }

 private:
  std::string_view text_;
  std::size_t pos_ = 0;
  int line_ = 0;  ///< number of the line read last
  int next_ = 1;  ///< number of the line at pos_
};

/// Number of a record group header, 0 for any other line. `exact`: written as the reference solver
/// demands.
int header_group(std::string_view line, bool& exact) {
  constexpr std::string_view kWords[] = {"**", "RECORD", "GROUP"};
  exact = line.substr(0, 16) == "** RECORD GROUP ";
  std::string_view rest = line;
  for (const std::string_view word : kWords) {
    rest = trimmed(rest);
    if (rest.size() < word.size()) return 0;
    for (std::size_t i = 0; i < word.size(); ++i)
      if (std::toupper(static_cast<unsigned char>(rest[i])) != word[i]) return 0;
    rest.remove_prefix(word.size());
    if (rest.empty() || !is_blank(rest[0])) return 0;
  }
  rest = trimmed(rest);
  int group = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), group);
  return error == std::errc() ? (group == 0 ? -1 : group) : 0;
}

class FemTextReader {
 public:
  FemTextReader(const std::string& name, std::string_view text) : scan_(text) { data_.name = name; }

  FemData read() {
    while (!scan_.at_end()) {
      const std::string_view line = scan_.peek_line();
      if (line.substr(0, 14) == "** END OF FILE") break;
      bool exact = false;
      const int group = header_group(line, exact);
      scan_.next_line();
      if (group == 0) {
        note_surplus(line);
        continue;
      }
      group_ = group;
      if (!exact)
        warn("the header of record group " + std::to_string(group) +
             " is not written `** RECORD GROUP " + std::to_string(group) + "`");
      read_group();
      surplus_noted_ = false;
    }
    finish();
    return std::move(data_);
  }

 private:
  [[noreturn]] void fail(const std::string& message, const std::string& hint = "") const {
    detail::refuse_fem_data(
        data_.name, scan_.line(),
        (group_ > 0 ? "record group " + std::to_string(group_) + ": " : std::string()) + message,
        hint);
  }
  void warn(const std::string& message) { detail::note_fem_data(data_, scan_.line(), message); }

  void note_surplus(std::string_view line) {
    double value;
    const std::string_view first = trimmed(line).substr(0, trimmed(line).find_first_of(" \t"));
    if (group_ == 0 || surplus_noted_ || first.empty() || !read_number(first, value)) return;
    warn("record group " + std::to_string(group_) +
         ": values after the last one expected are ignored");
    surplus_noted_ = true;
  }

  void read_group() {
    if (group_ < 1 || group_ > 13) detail::refuse_fem_group(data_.name, scan_.line(), group_);
    if (have_[group_]) fail("appears a second time");
    if (group_ != 1 && !have_[1])
      fail("found before record group 1", "the header group must come first");
    have_[group_] = true;
    data_.groups.push_back(group_);
    const int n = nodes_, m = modes_;
    switch (group_) {
      case 1:
        return read_header();
      case 2:
        return read_labels();
      case 3:
        data_.initial_amplitudes = values(m, 1);
        return;
      case 4:
        data_.initial_velocities = values(m, 1);
        return;
      case 5:
      case 6:
      case 7: {
        if (data_.positions.size() == 0) data_.positions.setZero(3, n);
        data_.positions.row(group_ - 5) = values(n, 1).transpose();
        return;
      }
      case 8:
        return read_shapes();
      case 9:
        data_.mass = values(m, m);
        return;
      case 10:
        data_.stiffness = values(m, m);
        return;
      case 11:
        data_.lumped = values(n, 6).transpose();
        return;
      case 12:
        return read_rigid();
      case 13:
        data_.damping = values(m, m);
        return;
    }
  }

  /// Comment lines between the header of group 1 and its data; a line that is no comment is one
  /// when it is not the data.
  void skip_header_comments() {
    int skipped = 0;
    while (!scan_.at_end()) {
      const std::string_view line = scan_.peek_line();
      bool exact = false;
      if (header_group(line, exact) != 0) break;
      const bool comment = is_comment(line) || trimmed(line).empty();
      if (!comment && (skipped > 0 || is_header_data(line))) break;
      scan_.next_line();
      ++skipped;
    }
    if (skipped != 1)
      warn("record group 1: " + std::to_string(skipped) +
           " comment lines before the data; other readers expect one");
  }
  static bool is_header_data(std::string_view line) {
    Scanner words(line);
    if (words.next_word().empty()) return false;
    for (int k = 0; k < 5; ++k) {
      int value;
      if (!read_number(words.next_word(), value)) return false;
    }
    return true;
  }

  void read_header() {
    skip_header_comments();
    data_.revision = std::string(scan_.next_word());
    if (data_.revision.empty()) fail("no data");
    static constexpr const char* kNames[] = {"nodes", "normal modes", "attachment modes",
                                             "constraint modes", "rejected modes"};
    int counts[5];
    for (int k = 0; k < 5; ++k) {
      const std::string_view word = scan_.next_word();
      if (!read_number(word, counts[k]))
        fail("number of " + std::string(kNames[k]) + ": an integer is expected, got " +
             quoted(word));
      if (counts[k] < 0)
        fail("number of " + std::string(kNames[k]) + " is negative: " + std::to_string(counts[k]));
    }
    const std::int64_t modes = std::int64_t{counts[1]} + counts[2] + counts[3] - counts[4];
    if (counts[0] < 1) fail("the file must have at least one node");
    if (modes < 1)
      fail("normal + attachment + constraint − rejected modes must be at least 1, got " +
           std::to_string(modes));
    scan_.next_line();
    const double left = static_cast<double>(scan_.remaining());
    const double n = counts[0], m = static_cast<double>(modes);
    if (8 * n + 12 * n * (m + counts[4]) + 4 * m * m > left + 16)
      fail("the header announces " + std::to_string(counts[0]) + " nodes and " +
           std::to_string(modes) + " modes, more than the file can hold");
    nodes_ = counts[0];
    modes_ = static_cast<int>(modes);
    data_.normal = counts[1];
    data_.attached = counts[2];
    data_.constraint = counts[3];
    data_.rejected = counts[4];
  }

  static std::string quoted(std::string_view word) {
    return word.empty() ? "nothing" : "\"" + std::string(word) + "\"";
  }

  void read_labels() {
    data_.labels.reserve(nodes_);
    for (int i = 0; i < nodes_; ++i) {
      const std::string_view word = scan_.next_word();
      if (word.empty())
        fail("ends after " + std::to_string(i) + " of " + std::to_string(nodes_) + " node labels");
      data_.labels.emplace_back(word);
    }
    scan_.next_line();
  }

  double value(std::int64_t k, std::int64_t count) {
    const std::string_view word = scan_.next_word();
    if (word.empty())
      fail("ends after " + std::to_string(k) + " of " + std::to_string(count) + " values");
    double v = 0;
    if (!read_number(word, v)) {
      const bool fortran = word.find_first_of("dD") != std::string_view::npos;
      fail("value " + std::to_string(k + 1) + " of " + std::to_string(count) +
               " is not a number: " + quoted(word),
           fortran ? "write exponents with E" : "");
    }
    if (!std::isfinite(v))
      fail("value " + std::to_string(k + 1) + " of " + std::to_string(count) + " is not finite");
    return v;
  }

  MatX values(int rows, int columns) {
    const std::int64_t count = std::int64_t{rows} * columns;
    if (static_cast<double>(count) > scan_.remaining() / 2 + 1)
      fail("ends before its " + std::to_string(count) + " values");
    MatX m(rows, columns);
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) m(i, j) = value(std::int64_t{i} * columns + j, count);
    scan_.next_line();
    return m;
  }

  void read_shapes() {
    const std::int64_t per_mode = std::int64_t{6} * nodes_;
    const double needed = static_cast<double>(per_mode) * (modes_ + data_.rejected);
    if (needed > scan_.remaining() / 2 + 1) fail("the file ends before all mode shapes");
    data_.shapes.resize(per_mode, modes_);
    bool odd_comments = false;
    for (int j = 0; j < modes_ + data_.rejected; ++j) {
      int comments = 0;
      bool exact = false;
      while (!scan_.at_end() &&
             (trimmed(scan_.peek_line()).empty() || is_comment(scan_.peek_line())) &&
             header_group(scan_.peek_line(), exact) == 0) {
        scan_.next_line();
        ++comments;
      }
      odd_comments = odd_comments || comments != 1;
      for (std::int64_t k = 0; k < per_mode; ++k) {
        const double v = value(j * per_mode + k, (modes_ + data_.rejected) * per_mode);
        if (j >= data_.rejected) data_.shapes(k, j - data_.rejected) = v;
      }
      scan_.next_line();
    }
    if (odd_comments)
      warn(
          "record group 8: not exactly one comment line before each mode; other readers expect "
          "one");
  }

  void read_rigid() {
    const MatX v = values(13, 1);
    FemRigidInertia inertia;
    inertia.mass = v(0);
    inertia.center = v.block<3, 1>(1, 0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) inertia.inertia(i, j) = v(4 + 3 * i + j);
    data_.rigid = inertia;
  }

  void finish() {
    group_ = 0;
    std::string missing;
    for (const int group : {1, 2, 5, 6, 7, 8, 9, 10})
      if (!have_[group]) missing += (missing.empty() ? "" : ", ") + std::to_string(group);
    if (!missing.empty())
      fail("record groups are missing: " + missing,
           "a group starts with a line `** RECORD GROUP <number>, ...`");
    if (data_.initial_amplitudes.size() == 0) data_.initial_amplitudes.setZero(modes_);
    if (data_.initial_velocities.size() == 0) data_.initial_velocities.setZero(modes_);
    detail::check_fem_data(data_);
  }

  Scanner scan_;
  FemData data_;
  int group_ = 0;  ///< being read or read last
  int nodes_ = 0, modes_ = 0;
  bool have_[14] = {};
  bool surplus_noted_ = false;
};

class FemTextWriter {
 public:
  void line(const std::string& s) { (out_ += s) += '\n'; }
  void group(int number, const char* title) {
    line("**");
    line("** RECORD GROUP " + std::to_string(number) + ", " + title);
  }
  void rows(const MatX& m) {
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      for (Eigen::Index j = 0; j < m.cols(); ++j) number(m(i, j));
      out_ += '\n';
    }
  }
  void number(double v) {
    char text[32];
    std::snprintf(text, sizeof text, " %24.16e", v);
    out_ += text;
  }
  std::string release() { return std::move(out_); }

 private:
  std::string out_;
};

}  // namespace

namespace detail {

FemData parse_fem_text(const std::string& name, std::string_view text) {
  return FemTextReader(name, text).read();
}

}  // namespace detail

std::string write_fem_text(const FemData& data, const std::vector<std::string>& comments) {
  FemTextWriter out;
  const int n = data.node_count(), m = data.mode_count();
  for (const std::string& comment : comments) out.line("** " + comment);
  out.group(1, "HEADER");
  out.line("**   REVISION,  NODE,  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.");
  out.line("   " + (data.revision.empty() ? "REV0" : data.revision) + " " + std::to_string(n) +
           " " + std::to_string(m) + " 0 0 0");
  out.group(2, "FINITE ELEMENT NODE LIST");
  for (const std::string& label : data.labels) out.line(" " + label);
  out.group(3, "INITIAL MODAL DISPLACEMENTS");
  out.rows(data.initial_amplitudes.transpose());
  out.group(4, "INITIAL MODAL VELOCITIES");
  out.rows(data.initial_velocities.transpose());
  static constexpr const char* kAxes[] = {"NODAL X COORDINATES", "NODAL Y COORDINATES",
                                          "NODAL Z COORDINATES"};
  for (int a = 0; a < 3; ++a) {
    out.group(5 + a, kAxes[a]);
    out.rows(data.positions.row(a).transpose());
  }
  out.group(8, "MODE SHAPES");
  for (int j = 0; j < m; ++j) {
    out.line("**    MODE SHAPE # " + std::to_string(j + 1));
    out.rows(Eigen::Map<const MatX>(data.shapes.col(j).data(), 6, n).transpose());
  }
  out.group(9, "MODAL MASS MATRIX");
  out.rows(data.mass);
  out.group(10, "MODAL STIFFNESS MATRIX");
  out.rows(data.stiffness);
  if (data.lumped) {
    out.group(11, "DIAGONAL OF LUMPED MASS MATRIX");
    out.rows(data.lumped->transpose());
  }
  if (data.rigid) {
    out.group(12, "RIGID-BODY INERTIA");
    out.rows(MatX::Constant(1, 1, data.rigid->mass));
    out.rows(data.rigid->center.transpose());
    out.rows(data.rigid->inertia);
  }
  if (data.damping) {
    out.group(13, "MODAL DAMPING MATRIX");
    out.rows(*data.damping);
  }
  out.line("** END OF FILE");
  return out.release();
}

}  // namespace mbcosim
