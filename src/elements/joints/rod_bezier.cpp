#include "elements/joints/rod_bezier.h"

namespace mbcosim {

namespace {

/// Abscissas and weights of Gauss's quadrature on −1 … 1: roots of Legendre's polynomial by
/// Newton's method.
std::vector<std::pair<double, double>> gauss_points(int n) {
  std::vector<std::pair<double, double>> points;
  for (int k = 0; k < n; ++k) {
    double x = std::cos(kPi * (k + 0.75) / (n + 0.5)), slope = 1;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double p = 1, before = 0;
      for (int j = 1; j <= n; ++j) {
        const double next = ((2 * j - 1) * x * p - (j - 1) * before) / j;
        before = p;
        p = next;
      }
      slope = n * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    points.emplace_back(x, 2 / ((1 - x * x) * slope * slope));
  }
  return points;
}

}  // namespace

void RodBezier::set_quadrature(int order, int segments) {
  samples.clear();
  for (int s = 0; s < segments; ++s)
    for (const auto& [x, w] : gauss_points(order)) {
      const double u = (s + 0.5 * (1 + x)) / segments;
      samples.push_back(
          {{-3 * u * u + 6 * u - 3, 9 * u * u - 12 * u + 3, -9 * u * u + 6 * u, 3 * u * u},
           w / (2 * segments)});
    }
}

double RodBezier::set_geometry(const Model& model) {
  const StructuralNode &n1 = model.structural[first], &n2 = model.structural[second];
  const Vec3 b[4] = {n1.x + n1.R * O, n1.x + n1.R * A, n2.x + n2.R * B, n2.x + n2.R * I};
  const Vec3 still[4] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  l1 = (b[1] - b[0]).normalized();
  l2 = (b[2] - b[3]).normalized();
  double length, rate;
  measure(b, still, length, rate);
  return length;
}

void RodBezier::output(const Local<double>& u, OutputRow& row) const {
  const double f = law_force(u)(0);
  double length, rate;
  measure(u, length, rate);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3(f, 0, 0), Vec3::Zero(), l1 * f, Vec3::Zero());
  row.vec3("F2", "N", l2 * f);
  row.scalar("l", "m", length);
  row.vec3("l1", "", l1);
  row.vec3("l2", "", l2);
  row.scalar("lP", "m/s", rate);
  output_law(u, row);
  row.end();
}

double RodBezier::own_datum(const Local<double>& u, int datum) const {
  if (datum == 0) return law_force(u)(0);
  double length, rate;
  measure(u, length, rate);
  return datum == 1 ? length : rate;
}

void read_rod_bezier(Card& card, ElementInfo& info) {
  RodBezier e;
  Attachment at = read_attachment(card);
  e.first = at.node;
  read_offset(card, at);
  e.O = at.f;
  const Attachment origin = at;
  read_offset(card, at);
  e.A = at.f;
  at = read_attachment(card);
  e.second = at.node;
  read_offset(card, at, &origin);
  e.B = at.f;
  read_offset(card, at, &origin);
  e.I = at.f;
  if (e.A == e.O || e.B == e.I)
    card.fail("rod bezier: two control points of a node are in one place",
              "the first and the last two give the directions at the ends");
  const bool from_nodes = card.keyword("from nodes");
  if (!from_nodes) {
    e.L0 = card.real("length");
    if (!(e.L0 > 0)) card.fail("rod bezier: the length must be positive");
  }
  constexpr int kMostPoints = 10, kMostSegments = 1000;
  int order = 2, segments = 3;
  if (card.keyword("integration order")) order = card.integer("integration order");
  if (order < 1 || order > kMostPoints)
    card.fail("rod bezier: the integration order must be from 1 to 10, got " +
              std::to_string(order));
  if (card.keyword("integration segments")) segments = card.integer("integration segments");
  if (segments < 1 || segments > kMostSegments)
    card.fail("rod bezier: the number of segments must be from 1 to 1000, got " +
              std::to_string(segments));
  e.set_quadrature(order, segments);
  double initial = 0;
  try {
    initial = e.set_geometry(card.model());
  } catch (const EvaluationError& error) {
    card.fail(error.what());
  }
  if (from_nodes) e.L0 = initial;
  card.set_current("L0", e.L0);
  card.set_current("L", initial);
  e.law = card.law1();
  add_element(card.builder(), info, std::move(e));
}

}  // namespace mbcosim
