/// Decks of beams in a line, written from numbers.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "deck_digits.h"
#include "deck_run.h"

namespace mbcosim {

inline Vec6 vec6(double a, double b, double c, double d, double e, double f) {
  Vec6 v;
  v << a, b, c, d, e, f;
  return v;
}

inline void expect_near(const Vec3& value, const Vec3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(value(i), expected(i), tolerance) << "component " << i + 1;
}

/// A matrix as decks have it.
template <int kSize>
std::string matrix_words(const MatN<kSize>& m) {
  std::string text = "matr";
  for (int i = 0; i < kSize; ++i)
    for (int j = 0; j < kSize; ++j) text += "," + digits(m(i, j));
  return text;
}

/// A line of beams through nodes 0, 1, 2, …; what is not said is a cantilever of static nodes along
/// x.
struct Line {
  std::vector<Vec3> position;
  int nodes_per_beam = 3;
  Vec6 stiffness = Vec6::Ones();    ///< EA, GA₂, GA₃, GJ, EI₂, EI₃ [N, N·m²]
  Mat6 coupling = Mat6::Zero();     ///< what the section's stiffness has beside its diagonal
  double proportional = 0;          ///< damping over stiffness [s]
  double mass = 0, polar = 0;       ///< per length [kg/m, kg·m]; 0: static nodes
  double rotary = 0;                ///< inertia of sections about their own axes 2, 3 [kg·m]
  Vec3 spin = Vec3::Zero();         ///< angular velocity of all nodes [rad/s]
  std::string orientation = "eye";  ///< of sections
  std::string supports = " joint: 1, clamp, 0, node, node;\n";
  std::string loads, data, initial;
  std::string more_nodes, more_bodies;    ///< cards, beside those of the line
  int other_nodes = 0, other_bodies = 0;  ///< how many
  int joints = 1, forces = 1;
  double step = 1;

  int tip() const { return static_cast<int>(position.size()) - 1; }
  void straight(int elements, double length) {
    const int pieces = (nodes_per_beam - 1) * elements;
    position.clear();
    for (int k = 0; k <= pieces; ++k) position.push_back(Vec3(length * k / pieces, 0, 0));
  }

  std::string deck() const {
    const int nodes = tip() + 1, beams = tip() / (nodes_per_beam - 1);
    const bool dynamic = mass > 0;
    std::string text = initial_value_block(
        step, 10000 * step,
        "tolerance: 1e-8; max iterations: 50; derivatives tolerance: 1e9; " + initial);
    text += "begin: control data; structural nodes: " + std::to_string(nodes + other_nodes) +
            "; beams: " + std::to_string(beams) + "; joints: " + std::to_string(joints) +
            "; forces: " + std::to_string(forces) + ";" +
            (dynamic ? " rigid bodies: " + std::to_string(nodes + other_bodies) + ";" : "") +
            " skip initial joint assembly; default output: none; " + data +
            " end: control data;\nbegin: nodes;\n" + more_nodes;
    for (int k = 0; k <= tip(); ++k)
      text += " structural: " + std::to_string(k) + (dynamic ? ", dynamic, " : ", static, ") +
              digits(position[k]) + ", eye, null, " + digits(spin) + ";\n";
    text += "end: nodes;\nbegin: elements;\n" + supports + more_bodies;
    for (int k = 0; k <= tip() && dynamic; ++k) text += body(k);
    for (int b = 0; b < beams; ++b) text += beam(b);
    return text + loads + "end: elements;\n";
  }

 private:
  std::string law() const {
    std::string text =
        proportional > 0 ? "linear viscoelastic generic, " : "linear elastic generic, ";
    if (coupling.isZero()) {
      text += "diag";
      for (int i = 0; i < 6; ++i) text += "," + digits(stiffness(i));
    } else {
      text += matrix_words<6>(Mat6(stiffness.asDiagonal()) + coupling);
    }
    return proportional > 0 ? text + ", proportional, " + digits(proportional) : text;
  }
  std::string beam(int b) const {
    std::string text = " beam" + std::to_string(nodes_per_beam) + ": " + std::to_string(b);
    for (int k = 0; k < nodes_per_beam; ++k)
      text += ", " + std::to_string((nodes_per_beam - 1) * b + k) + ", null";
    return text + ", " + orientation + ", " + law() +
           (nodes_per_beam == 3 ? ", same, same;\n" : ";\n");
  }
  /// The tributary piece of a line along x, lumped at its node.
  std::string body(int k) const {
    const double left = k == 0 ? 0 : (position[k] - position[k - 1]).norm() / 2,
                 right = k == tip() ? 0 : (position[k + 1] - position[k]).norm() / 2,
                 h = left + right;
    const double j = mass * h * h * h / 12 + rotary * h;
    return " body: " + std::to_string(k) + ", " + std::to_string(k) + ", " + digits(mass * h) +
           ", " + digits((right - left) / 2) + ", 0., 0., diag, " +
           digits((polar > 0 ? polar : 1e-3 * mass) * h) + "," + digits(j) + "," + digits(j) +
           ";\n";
  }
};

/// Options of `initial value` for loads that grow slowly.
inline constexpr const char* kQuasiStatic = "method: implicit euler; tolerance: 1e-6;";

}  // namespace mbcosim
