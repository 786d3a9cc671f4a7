/// Vectors, matrices and orientations as a deck writes them (MBDyn input manual, "Basic syntax").
#include <Eigen/Dense>
#include <array>
#include <limits>

#include "input/deck_card.h"
#include "math/rotation.h"

namespace mbcosim {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr std::array<const char*, 6> kOrdinals = {"first",  "second", "third",
                                                  "fourth", "fifth",  "sixth"};

/// ANBA ordering: value k of row j belongs to element (p(j), p(k)).
constexpr std::array<int, 6> kAnba = {1, 2, 0, 4, 5, 3};

std::string component_name(std::string_view what, int index) {
  std::string name(what);
  if (index < static_cast<int>(kOrdinals.size()))
    return name + ": " + kOrdinals[index] + " component";
  return name + ": component " + std::to_string(index + 1);
}

/// The vector b that `guess` stands for: large where a is small.
Vec3 guessed(const Vec3& a) {
  int largest = 0, smallest = 0;
  if (std::abs(a(1)) > std::abs(a(0)))
    largest = 1;
  else
    smallest = 1;
  if (std::abs(a(2)) > std::abs(a(largest)))
    largest = 2;
  else if (std::abs(a(2)) < std::abs(a(smallest)))
    smallest = 2;
  Vec3 b = Vec3::Zero();
  b(smallest) = 1;
  b(largest) = -a(smallest) / a(largest);
  return b;
}

}  // namespace

double DeckCard::component(std::string_view what, int index) {
  return real(component_name(what, index));
}

void DeckCard::scale(std::string_view what, double& factor) {
  factor = keyword("scale") ? real(std::string(what) + ": scale") : 1;
}

template <class V>
V DeckCard::vector(std::string_view what) {
  V v = V::Zero();
  need_argument(what);
  if (one_of({"null", "default"}) >= 0) return v;
  for (int i = 0; i < v.size(); ++i) v(i) = component(what, i);
  double s;
  scale(what, s);
  return v * s;
}

Vec3 DeckCard::vec3(std::string_view what) { return vector<Vec3>(what); }
Vec6 DeckCard::vec6(std::string_view what) { return vector<Vec6>(what); }

template <class M>
void DeckCard::matrix_body(std::string_view what, bool allow_skew, M& m) {
  constexpr int n = M::RowsAtCompileTime;
  m.setZero();
  if (keyword("eye")) {
    m.setIdentity();
  } else if (keyword("diag")) {
    for (int i = 0; i < n; ++i) m(i, i) = component(what, i);
  } else if (keyword("sym")) {
    for (int i = 0, k = 0; i < n; ++i)
      for (int j = i; j < n; ++j, ++k) m(i, j) = m(j, i) = component(what, k);
  } else if (allow_skew && keyword("skew")) {
    if constexpr (n == 3) {
      Vec3 v;
      for (int i = 0; i < 3; ++i) v(i) = component(what, i);
      m = -cross(v);
    }
  } else if (n == 6 && keyword("anba")) {
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) m(kAnba[j], kAnba[k]) = component(what, j * n + k);
  } else {
    keyword("matr");
    for (int i = 0; i < n * n; ++i) m(i / n, i % n) = component(what, i);
  }
}

Mat3 DeckCard::mat3(std::string_view what) {
  need_argument(what);
  if (one_of({"null", "default"}) >= 0) return Mat3::Zero();
  Mat3 m;
  double s;
  matrix_body(what, true, m);
  scale(what, s);
  return m * s;
}

Mat6 DeckCard::mat6(std::string_view what) {
  need_argument(what);
  if (one_of({"null", "default"}) >= 0) return Mat6::Zero();
  Mat6 m;
  double s;
  matrix_body(what, false, m);
  scale(what, s);
  return m * s;
}

MatX DeckCard::mat6xn(std::string_view what, int columns) {
  need_argument(what);
  need_numbers(what, columns);
  MatX m = MatX::Zero(6, columns);
  if (keyword("null")) return m;
  const bool anba = keyword("anba");
  if (!anba) keyword("matr");
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < columns; ++j) m(anba ? kAnba[i] : i, j) = component(what, i * columns + j);
  double s;
  scale(what, s);
  return m * s;
}

MatX DeckCard::numbers(std::string_view what, int rows, int columns) {
  need_numbers(what, static_cast<std::int64_t>(rows) * columns);
  MatX m(rows, columns);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j)
      m(i, j) = real(std::string(what) + " (" + std::to_string(i + 1) + "," +
                     std::to_string(j + 1) + ")");
  return m;
}

Vec3 DeckCard::angles(std::string_view what) {
  const double unit = keyword("degrees") ? 1 / kDegrees : 1;
  Vec3 a;
  for (int i = 0; i < 3; ++i) a(i) = component(what, i) * unit;
  return a;
}

Mat3 DeckCard::orientation(std::string_view what) {
  need_argument(what);
  switch (one_of(
      {"eye", "euler", "euler123", "euler313", "euler321", "vector", "matr", "euler parameters"})) {
    case 0:
      return Mat3::Identity();
    case 1:
    case 2:
      return rotation_of_euler123(angles(what));
    case 3:
      return rotation_of_euler313(angles(what));
    case 4:
      return rotation_of_euler321(angles(what));
    case 5: {
      Vec3 p;
      for (int i = 0; i < 3; ++i) p(i) = component(what, i);
      return rotation_of_vector(p);
    }
    case 6:
      return matrix_orientation(what);
    case 7:
      fail(std::string(what) + ": euler parameters are not supported as input",
           "write the rotation as euler, vector or matr");
    default:
      refuse_word(what);
      return two_vectors(what);
  }
}

Mat3 DeckCard::matrix_orientation(std::string_view what) {
  const SourceSpan where = last();
  Mat3 r;
  for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = component(what, i);
  double tolerance = 1e-12;
  if (keyword("tolerance")) tolerance = real_above(std::string(what) + ": tolerance", 0, true);
  const double deviation = (r.transpose() * r - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (deviation <= tolerance) return r;
  char text[64];
  std::snprintf(text, sizeof text, "(deviation %g)", deviation);
  const std::string message = std::string(what) + ": orientation matrix is not orthogonal " + text;
  if (!(deviation <= std::max(1e-6, tolerance)))
    fail_at(where, message,
            "give at least seven correct digits, or two of its axes: 1, x1,x2,x3, 2, y1,y2,y3");
  warn_at(where, message);
  return r;
}

Mat3 DeckCard::two_vectors(std::string_view what) {
  const std::string name(what);
  const auto axis = [&](const char* text) {
    const int i = integer(name + ": " + text);
    if (i < 1 || i > 3) fail(name + ": axis index must be 1, 2 or 3, got " + std::to_string(i));
    return i - 1;
  };
  const auto direction = [&](const char* text) {
    Vec3 v;
    for (int i = 0; i < 3; ++i) v(i) = component(name + ": " + text + " vector", i);
    return v;
  };
  const int ia = axis("first axis index or a keyword (eye, euler, vector, matr)");
  const Vec3 a = direction("first");
  if (!(a.norm() > kEpsilon)) fail(name + ": first vector is null");
  const int ib = axis("second axis index");
  if (ib == ia) fail(name + ": second axis index equals the first");
  const Vec3 b = keyword("guess") ? guessed(a) : direction("second");
  if (!(b.norm() > kEpsilon)) fail(name + ": second vector is null");
  const Vec3 ca = a.normalized();
  const bool follows = ib == (ia + 1) % 3;
  const Vec3 normal = follows ? Vec3(ca.cross(b.normalized())) : Vec3(b.normalized().cross(ca));
  if (!(normal.squaredNorm() > kEpsilon))
    fail(name + ": vectors are parallel", "give two axes with different directions");
  const int ic = 3 - ia - ib;
  Mat3 r;
  r.col(ia) = ca;
  r.col(ic) = normal.normalized();
  r.col(ib) = follows ? Vec3(r.col(ic).cross(ca)) : Vec3(ca.cross(r.col(ic)));
  return r;
}

OrientationDescription DeckCard::orientation_description() {
  constexpr OrientationDescription kinds[] = {
      OrientationDescription::euler123, OrientationDescription::euler313,
      OrientationDescription::euler321, OrientationDescription::vector,
      OrientationDescription::matrix};
  return kinds[required("orientation description", {"euler123", "euler313", "euler321",
                                                    "orientation vector", "orientation matrix"})];
}

}  // namespace mbcosim
