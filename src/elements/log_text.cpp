#include "elements/log_text.h"

#include <charconv>

namespace mbcosim {

namespace {

void append(std::string& s, double value) {
  char buffer[32];
  const auto end =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 6).ptr;
  s += ' ';
  s.append(buffer, end);
}

}  // namespace

std::string log_integers(std::initializer_list<int> values) {
  std::string s;
  for (const int v : values) s += ' ' + std::to_string(v);
  return s;
}

std::string log_values(std::initializer_list<double> values) {
  std::string s;
  for (const double v : values) append(s, v);
  return s;
}

std::string log_vector(const Vec3& v) { return log_values({v(0), v(1), v(2)}); }

std::string log_matrix(const Mat3& m) {
  return log_values(
      {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)});
}

}  // namespace mbcosim
