#include "elements/beams/beam_slider.h"

#include <cmath>

#include "elements/beams/beam.h"
#include "elements/log_text.h"

namespace mbcosim {

/// Everything at the present place of the slider.
struct BeamSlider::Place {
  int span;
  const Span* beam;
  const std::array<int, 3>* local;
  double s, n[3], dn[3], ddn[3];
  double w[3], dw[3];  ///< weights of the beam nodes and their slopes
  Vec3 node_x[3], arm[3];
  Vec3 x, l, bend;  ///< point, slope and its slope
  Vec3 f, x_c, F, M;
  Mat3 E;
  double m2, m3;
};

void BeamSlider::connect(GeneralConnection& c) {
  slider_ = c.node(node);
  for (const Span& s : spans) {
    std::array<int, 3> local;
    for (int k = 0; k < 3; ++k) local[k] = c.node(s.node[k]);
    beam_.push_back(local);
  }
  own_ = c.algebraic(classic ? 6 : 4);
  c.memory(1);
}

/// The span that holds s_ref, sought from the one of the last accepted step on; an imported state
/// may name one that is not there.
int BeamSlider::span_at(const GeneralView& u, double s_ref) const {
  const int last = static_cast<int>(spans.size()) - 1;
  const double before = u.memory(0);
  int b = before >= 0 && before <= last ? static_cast<int>(before) : 0;
  while (b > 0 && s_ref - 2 * b < -1) --b;
  while (b < last && s_ref - 2 * b > 1) ++b;
  return b;
}

void BeamSlider::set_weights(double s, Place& p) const {
  const double d = 1 / std::sqrt(3.0);
  for (int k = 0; k < 3; ++k) p.w[k] = p.dw[k] = 0;
  const auto pass = [&](int from, double bound) {
    p.dw[from] = -1 / (2 * smearing);
    p.dw[from + 1] = -p.dw[from];
    p.w[from] = 0.5 + (s - bound) * p.dw[from];
    p.w[from + 1] = 1 - p.w[from];
  };
  if (s < -d - smearing)
    p.w[0] = 1;
  else if (s < -d + smearing)
    pass(0, -d);
  else if (s > d + smearing)
    p.w[2] = 1;
  else if (s > d - smearing)
    pass(1, d);
  else
    p.w[1] = 1;
}

BeamSlider::Place BeamSlider::place(const GeneralView& u) const {
  Place p;
  const double s_ref = u.value(own_);
  p.span = span_at(u, s_ref);
  p.beam = &spans[p.span];
  p.local = &beam_[p.span];
  p.s = s_ref - 2 * p.span;
  const double s = p.s;
  const double n[3] = {s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2},
               dn[3] = {s - 0.5, -2 * s, s + 0.5}, ddn[3] = {1, -2, 1};
  p.x = p.l = p.bend = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    p.n[k] = n[k];
    p.dn[k] = dn[k];
    p.ddn[k] = ddn[k];
    const NodeState node = u.node(p.beam->node[k]);
    p.node_x[k] = node.x;
    p.arm[k] = node.R * p.beam->offset[k];
    p.x += n[k] * (node.x + p.arm[k]);
    p.l += dn[k] * (node.x + p.arm[k]);
    p.bend += ddn[k] * (node.x + p.arm[k]);
  }
  const NodeState slider = u.node(node);
  p.f = slider.R * offset;
  p.x_c = slider.x + p.f;
  p.E = slider.R * Rs;
  for (int i = 0; i < 3; ++i) p.F(i) = u.value(own_ + 1 + i);
  p.m2 = classic ? u.value(own_ + 4) : 0;
  p.m3 = classic ? u.value(own_ + 5) : 0;
  p.M = Vec3(p.m2 * p.E.col(1) + p.m3 * p.E.col(2)).cross(p.l);
  set_weights(s, p);
  return p;
}

void BeamSlider::residual(const GeneralView& u, GeneralResidual& r) const {
  const Place p = place(u);
  r.load(slider_, p.F, p.M + p.f.cross(p.F));
  for (int k = 0; k < 3; ++k)
    if (p.w[k] != 0)
      r.load((*p.local)[k], -p.w[k] * p.F, -p.w[k] * (p.M + Vec3(p.x_c - p.node_x[k]).cross(p.F)));
  r.add(own_, p.F.dot(p.l) / u.c());
  r.add3(own_ + 1, (p.x_c - p.x) / u.c());
  if (!classic) return;
  r.add(own_ + 4, p.E.col(1).dot(p.l) / u.c());
  r.add(own_ + 5, p.E.col(2).dot(p.l) / u.c());
}

/// Rows row … row + 2 depend on l by the matrix `by_l`: l on the beam's nodes and on s.
void BeamSlider::add_tangent_terms(const Place& p, GeneralJacobian& j, int row,
                                   const Mat3& by_l) const {
  const Mat3 zero = Mat3::Zero();
  for (int k = 0; k < 3; ++k) {
    const int column = (*p.local)[k];
    j.translation(row, column, by_l * p.dn[k], zero);
    j.rotation(row, column + 3, p.beam->node[k], -p.dn[k] * by_l * cross<double>(p.arm[k]), zero);
  }
  const Vec3 by_s = by_l * p.bend;
  for (int i = 0; i < 3; ++i) j.value(row + i, own_, by_s(i));
}

/// `factor` M in the rows row … row + 2.
void BeamSlider::add_moment_terms(const Place& p, GeneralJacobian& j, int row,
                                  double factor) const {
  if (!classic) return;
  const Mat3 lx = cross<double>(p.l), zero = Mat3::Zero();
  const Vec3 axis = p.m2 * p.E.col(1) + p.m3 * p.E.col(2);
  j.rotation(row, slider_ + 3, node, factor * lx * cross<double>(axis), zero);
  add_tangent_terms(p, j, row, factor * cross<double>(axis));
  const Vec3 by_m2 = factor * p.E.col(1).cross(p.l), by_m3 = factor * p.E.col(2).cross(p.l);
  for (int i = 0; i < 3; ++i) {
    j.value(row + i, own_ + 4, by_m2(i));
    j.value(row + i, own_ + 5, by_m3(i));
  }
}

void BeamSlider::add_loads(const Place& p, GeneralJacobian& j) const {
  const Mat3 one = Mat3::Identity(), zero = Mat3::Zero(), Fx = cross<double>(p.F),
             fx = cross<double>(p.f);
  const auto by_force = [&](int row, const Mat3& m) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) j.value(row + a, own_ + 1 + b, m(a, b));
  };
  by_force(slider_, one);
  by_force(slider_ + 3, fx);
  j.rotation(slider_ + 3, slider_ + 3, node, Fx * fx, zero);
  add_moment_terms(p, j, slider_ + 3, 1);
  for (int k = 0; k < 3; ++k) {
    const int row = (*p.local)[k];
    const Vec3 reach = p.x_c - p.node_x[k];
    if (p.dw[k] != 0) {
      const Vec3 m = p.M + reach.cross(p.F);
      for (int i = 0; i < 3; ++i) {
        j.value(row + i, own_, -p.dw[k] * p.F(i));
        j.value(row + 3 + i, own_, -p.dw[k] * m(i));
      }
    }
    const double w = p.w[k];
    if (w == 0) continue;
    by_force(row, -w * one);
    by_force(row + 3, -w * cross<double>(reach));
    j.translation(row + 3, slider_, w * Fx, zero);
    j.rotation(row + 3, slider_ + 3, node, -w * Fx * fx, zero);
    j.translation(row + 3, row, -w * Fx, zero);
    add_moment_terms(p, j, row + 3, -w);
  }
}

void BeamSlider::jacobian(const GeneralView& u, GeneralJacobian& j) const {
  const Place p = place(u);
  const Mat3 zero = Mat3::Zero(), fx = cross<double>(p.f);
  add_loads(p, j);
  const double c = u.c();
  // F·l: the first of three rows
  for (int i = 0; i < 3; ++i) j.value(own_, own_ + 1 + i, p.l(i) / c);
  Mat3 by_l = zero;
  by_l.row(0) = p.F.transpose() / c;
  add_tangent_terms(p, j, own_, by_l);
  // x_c − x
  j.translation(own_ + 1, slider_, Mat3::Identity() / c, zero);
  j.rotation(own_ + 1, slider_ + 3, node, -fx / c, zero);
  for (int k = 0; k < 3; ++k) {
    const int column = (*p.local)[k];
    j.translation(own_ + 1, column, -p.n[k] / c * Mat3::Identity(), zero);
    j.rotation(own_ + 1, column + 3, p.beam->node[k], p.n[k] / c * cross<double>(p.arm[k]), zero);
  }
  for (int i = 0; i < 3; ++i) j.value(own_ + 1 + i, own_, -p.l(i) / c);
  if (!classic) return;
  // e₂·l, e₃·l: the last two of three rows
  Mat3 turn = zero;
  by_l = zero;
  for (int k = 1; k < 3; ++k) {
    by_l.row(k) = p.E.col(k).transpose() / c;
    turn.row(k) = p.E.col(k).cross(p.l).transpose() / c;
  }
  add_tangent_terms(p, j, own_ + 3, by_l);
  j.rotation(own_ + 3, slider_ + 3, node, turn, zero);
}

void BeamSlider::start(const GeneralView& u, State& state) const {
  state.y[u.unknown(own_)] = s0;
  state.memory[u.memory_offset()] =
      std::min(std::max(0.0, std::floor((s0 + 1) / 2)), static_cast<double>(spans.size() - 1));
}

void BeamSlider::after_convergence(const GeneralView& u, State& state) const {
  state.memory[u.memory_offset()] = span_at(u, u.value(own_));
}

std::string BeamSlider::row_name(int own) const {
  return own == 0  ? "no force along the beam"
         : own < 4 ? "position constraint " + std::to_string(own)
                   : "direction constraint " + std::to_string(own - 3);
}

/// As in the reference solver without the offset on the first node of the chain.
std::string BeamSlider::log(const Model& model, int label) const {
  const auto node_label = [&](int n) { return model.structural[n].label; };
  std::string line = "beamslider:" + log_integers({label, node_label(node)}) + log_vector(offset) +
                     log_matrix(Rs) + log_integers({static_cast<int>(spans.size())});
  for (const Span& s : spans) {
    line += log_integers({s.label});
    for (int k = 0; k < 3; ++k) {
      line += log_integers({node_label(s.node[k])});
      if (k > 0 || &s != &spans.front()) line += log_vector(s.offset[k]);
      line += log_matrix(s.orientation[k]);
    }
  }
  return line;
}

/// As in the reference solver the moment's local columns are global, and its global ones turned by
/// E once more.
void BeamSlider::output(const GeneralView& u, OutputRow& row) const {
  const Place p = place(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(p.E.transpose() * p.F, p.M, p.F, p.E * p.M);
  row.integer(p.beam->label);
  row.scalar("s", "", u.value(own_));
  row.vec3("l", "m", p.l);
  row.end();
}

// ------------------------------------------------------------------ reader

namespace {

/// `same`: that of the beam before.
Mat3 read_hinge(Card& card, int node, const Mat3& same) {
  if (!card.keyword("hinge")) return Mat3::Identity();
  if (card.keyword("same")) return same;
  return card.relative_orientation("orientation of the beam", node);
}

BeamSlider::Span read_span(Card& card, const BeamSlider::Span* before) {
  const ElementRef e = card.element(Family::beam);
  const auto* beams = dynamic_cast<const ElementSetOf<Beam3>*>(e.set);
  if (!beams) card.fail("beam slider: a three-node beam is needed");
  BeamSlider::Span s;
  s.label = e.set->info(e.index).label;
  for (int k = 0; k < 3; ++k) {
    s.node[k] = beams->element(e.index).node[k];
    if (k == 0 && before && s.node[0] != before->node[2])
      card.fail("beam slider: beam " + std::to_string(s.label) +
                    " does not begin at the last node of beam " + std::to_string(before->label),
                "list the beams in the order of the chain");
    if (k == 0 && before && card.keyword("same")) {
      s.offset[0] = before->offset[2];
    } else {
      s.offset[k] = card.relative_position("offset on the beam", s.node[k]);
      if (k == 0 && before && s.offset[0] != before->offset[2])
        card.fail("beam slider: the offset differs from that of the beam before", "write `same`");
    }
    s.orientation[k] = read_hinge(
        card, s.node[k], k == 0 && before ? before->orientation[2] : Mat3(Mat3::Identity()));
  }
  return s;
}

void read_start(Card& card, BeamSlider& e) {
  const int count = static_cast<int>(e.spans.size());
  int beam = 1, node = 2;
  if (card.keyword("initial beam")) beam = card.integer("initial beam");
  if (beam < 1 || beam > count)
    card.fail("beam slider: the initial beam must be from 1 to " + std::to_string(count));
  if (card.keyword("initial node")) node = card.integer("initial node");
  if (node < 1 || node > 3) card.fail("beam slider: the initial node must be 1, 2 or 3");
  e.s0 = 2 * (beam - 1) + node - 2;
  constexpr double kWidest = 0.4;
  if (!card.keyword("smearing")) return;
  e.smearing = card.real("smearing");
  if (!(e.smearing >= 0 && e.smearing <= kWidest))
    card.fail("beam slider: the smearing must be from 0 to 0.4, got " + std::to_string(e.smearing));
}

}  // namespace

void read_beam_slider(Card& card, ElementInfo& info) {
  auto e = std::make_unique<BeamSlider>();
  e->node = card.structural_node();
  e->offset = card.relative_position("offset", e->node);
  if (card.keyword("hinge")) e->Rs = card.relative_orientation("orientation", e->node);
  if (card.keyword("type")) {
    const int type = card.required("type", {"spherical", "classic", "spline"});
    if (type == 2)
      card.fail("beam slider: the equations of type `spline` are singular",
                "use `classic` or `spherical`");
    e->classic = type == 1;
  }
  constexpr int kMost = 100;  // all their nodes meet in the matrix
  const int count = card.integer("number of beams");
  if (count < 1 || count > kMost)
    card.fail("beam slider: the number of beams must be from 1 to 100, got " +
              std::to_string(count));
  for (int k = 0; k < count; ++k)
    e->spans.push_back(read_span(card, k == 0 ? nullptr : &e->spans.back()));
  read_start(card, *e);
  for (const BeamSlider::Span& s : e->spans)
    for (const int n : s.node)
      if (n == e->node) card.fail("beam slider: the node is one of the beam's");
  add_general_element(card.builder(), info, std::move(e));
}

}  // namespace mbcosim
