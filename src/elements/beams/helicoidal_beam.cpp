#include "elements/beams/helicoidal_beam.h"

#include <limits>
#include <sstream>

#include "math/rotation_vector.h"
#include "model/card.h"

namespace mbcosim {

template <class T>
HelicoidalBeam::Section<T> HelicoidalBeam::section(const Vec<T> (&p)[2], const Mat<T> (&R)[2]) {
  const Vec<T> phi = vector_of_rotation(Mat<T>(R[1] * R[0].transpose()));
  const Vec<T> half = phi * T(0.5);
  const Vec<T> rho = inverse_rotation_gamma(phi, Vec<T>(p[1] - rotation_of_vector(phi) * p[0]));
  const Mat<T> turn = rotation_of_vector(half);
  Section<T> s;
  s.p = turn * p[0] + rotation_gamma(half, rho) * T(0.5);
  s.R = turn * R[0];
  s.bend.template head<3>() = s.R.transpose() * Vec<T>(rho + phi.cross(s.p));
  s.bend.template tail<3>() = s.R.transpose() * phi;
  return s;
}

void HelicoidalBeam::set_geometry(const Model& model) {
  Vec3 p[2];
  Mat3 R[2];
  for (int k = 0; k < 2; ++k) {
    const StructuralNode& n = model.structural[node[k]];
    p[k] = n.x + n.R * offset[k];
    R[k] = n.R * relative[k];
  }
  const Section<double> s = section(p, R);
  length = s.bend.head<3>().norm();
  origin = s.bend / length;
}

void HelicoidalBeam::start(Start& s) const {
  s.memory(0) = s.u.context->phase == Phase::step || !s.u.model().control.skip_assembly;
}

void HelicoidalBeam::after_predict(const Local<double>& u, State& state) const {
  state.memory[u.memory_offset()] = 1;
}

void HelicoidalBeam::output(const Local<double>& u, OutputRow& row) const {
  const Vec6 f = is_unloaded(u) ? Vec6(Vec6::Zero()) : internal_force(u, section(u));
  row.begin(OutputFile::act, u.label());
  row.vec3("F", "N", f.head<3>());
  row.vec3("M", "N m", f.tail<3>());
  row.end();
}

std::string HelicoidalBeam::log(const Model& model, int label) const {
  std::ostringstream out;
  out << "hbeam: " << label;
  for (int k = 0; k < 2; ++k)
    out << ' ' << model.structural[node[k]].label << ' ' << offset[k](0) << ' ' << offset[k](1)
        << ' ' << offset[k](2);
  return out.str();
}

/// `<node> , [position,] <f> [ , {orientation|rot} , <R> ]` twice, then an elastic law.
void read_helicoidal_beam(Card& card, ElementInfo& info) {
  HelicoidalBeam e;
  bool default_frame = false;
  for (int k = 0; k < 2; ++k) {
    e.node[k] = card.structural_node();
    card.keyword("position");
    e.offset[k] = card.relative_position("offset of the beam", e.node[k]);
    if (card.one_of({"orientation", "rot"}) >= 0) {
      e.relative[k] = card.relative_orientation("orientation of the beam", e.node[k]);
    } else {
      e.relative[k] = card.model().structural[e.node[0]].R;
      default_frame = true;
    }
  }
  if (default_frame)
    card.warn(
        "hbeam: an end without `orientation` takes the global orientation of node 1 as its "
        "own relative one, as in the reference solver",
        "write `orientation, reference, node, eye` for an end aligned with its node");
  e.law = card.law6();
  if (e.law->type() != LawType::elastic)
    card.fail("hbeam: only elastic laws are accepted", "use `beam2` for a viscoelastic section");
  if (e.node[0] == e.node[1]) card.fail_at(info.where, "hbeam: both ends are on the same node");
  e.set_geometry(card.model());
  if (!(e.length > std::numeric_limits<double>::epsilon()))
    card.fail_at(info.where, "hbeam: its ends are in one place",
                 "place the nodes (with their offsets) at distinct points");
  add_element(card.builder(), info, std::move(e));
}

}  // namespace mbcosim
