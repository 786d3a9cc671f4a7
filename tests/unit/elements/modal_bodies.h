/// Small flexible bodies as FEM data text, for tests.
#pragma once

#include <string>
#include <vector>

#include "elements/modal/fem_data.h"
#include "elements/modal/modal_body.h"

namespace mbcosim::decks {

/// Three nodes 1001, 1002, 1003 at y = −2, 0, 2 and two modes (uz, ux of the outer nodes).
/// `dynamic`: modal masses 2 and lumped unit masses; else no modal mass and a rigid inertia.
inline FemData hand_made(bool dynamic) {
  FemData d;
  d.name = "hand-made.fem";
  d.labels = {"1001", "1002", "1003"};
  d.positions = MatX::Zero(3, 3);
  d.positions.row(1) << -2, 0, 2;
  d.shapes = MatX::Zero(18, 2);
  d.shapes(2, 0) = d.shapes(14, 0) = 1;
  d.shapes(0, 1) = d.shapes(12, 1) = 1;
  d.stiffness = Eigen::Vector2d(1, 100).asDiagonal();
  d.mass = dynamic ? MatX(Eigen::Vector2d(2, 2).asDiagonal()) : MatX::Zero(2, 2);
  d.initial_amplitudes = d.initial_velocities = VecX::Zero(2);
  if (dynamic) d.lumped = MatX::Ones(6, 3);
  if (!dynamic) d.rigid = FemRigidInertia{3, Vec3::Zero(), Vec3(11, 3, 11).asDiagonal()};
  return d;
}

/// Four nodes, three modes, every invariant non-zero.
inline FemData generic_body() {
  FemData d;
  d.name = "generic.fem";
  d.labels = {"1", "2", "3", "tip"};
  d.positions.resize(3, 4);
  d.positions << 0, .5, 1, 1.5, 0, .1, -.1, 0, 0, 0, .2, .1;
  d.shapes = MatX::Zero(24, 3);
  d.shapes.col(0).tail(18) << 0, .1, .02, 0, -.02, .3, .01, .4, .05, .05, -.1, .7, -.02, .9, .1, .1,
      -.1, 1;
  d.shapes.col(1).tail(18) << .02, -.05, .2, .1, -.4, .05, .05, .02, .5, .2, -.6, -.1, .03, .1, 1.1,
      .3, -.7, .1;
  d.shapes.col(2).tail(18) << .1, 0, .03, .3, .05, -.02, .25, -.05, .02, .6, .02, .1, .4, .03, -.06,
      .9, .1, .05;
  d.mass.resize(3, 3);
  d.mass << 1.10751, .23802, .01369, .23802, 1.539245, .05619, .01369, .05619, .427297;
  d.stiffness.resize(3, 3);
  d.stiffness << 400, 20, 10, 20, 600, -30, 10, -30, 900;
  MatX lumped(4, 6);
  lumped << 1, 1, 1, .1, .2, .3, 2, 2, 2, .05, .1, .15, 1.5, 1.5, 1.5, .02, .03, .04, .8, .8, .8,
      .2, .1, .15;
  d.lumped = lumped.transpose();
  d.initial_amplitudes = d.initial_velocities = VecX::Zero(3);
  return d;
}

inline std::shared_ptr<const ModalBody> make_body(const FemData& data, bool second_order = false,
                                                  const Vec3& origin = Vec3::Zero(),
                                                  std::vector<std::string>* warnings = nullptr) {
  ModalSelection s;
  for (int j = 1; j <= data.mode_count(); ++j) s.modes.push_back(j);
  s.damping.kind = ModalDamping::Kind::none;
  s.second_order_inertia = second_order;
  s.origin = origin;
  std::vector<std::string> ignored;
  return make_modal_body(data, s, warnings ? *warnings : ignored);
}

}  // namespace mbcosim::decks
