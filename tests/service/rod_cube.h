/// A simulation whose factorizations take megabytes, for tests of how memory is counted.
#pragma once

#include <memory>
#include <string>

#include "deck_simulation.h"

namespace mbcosim::server {

/// A cube of 8³ masses between rods, 3072 unknowns. One rod more from t = 2.5 ms on makes a matrix
/// of another kind, which is factored anew.
inline std::string rod_cube_deck() {
  constexpr int kSide = 8;
  std::string nodes, elements;
  int rods = 0;
  const auto label = [](int i, int j, int k) {
    return std::to_string(1 + i + kSide * (j + kSide * k));
  };
  const auto rod = [&](const std::string& a, const std::string& b) {
    return "joint: " + std::to_string(++rods) + ", rod, " + a + ", " + b +
           ", from nodes, linear viscoelastic, 1e3, 1.;\n";
  };
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const std::string self = label(i, j, k);
        nodes += "structural: " + self + ", dynamic displacement, " + std::to_string(i) + ".," +
                 std::to_string(j) + ".," + std::to_string(k) + "., null;\n";
        elements += "body: " + self + ", " + self + ", 1.;\n";
        if (i + 1 < kSide) elements += rod(self, label(i + 1, j, k));
        if (j + 1 < kSide) elements += rod(self, label(i, j + 1, k));
        if (k + 1 < kSide) elements += rod(self, label(i, j, k + 1));
      }
  const std::string last = rod(label(0, 0, 0), label(7, 7, 7));
  elements += "driven: " + std::to_string(rods) + ", string, \"Time > .0025\", " + last;
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: 1.; time step: 1e-3; method: ms, .6; tolerance: 1e-6; max iterations: 20; "
         "derivatives tolerance: 1.; end: initial value;\nbegin: control data; structural nodes: "
         "512; rigid bodies: 512; joints: " +
         std::to_string(rods) + "; end: control data;\nbegin: nodes;\n" + nodes +
         "end: nodes;\nbegin: elements;\n" + elements + "end: elements;\n";
}

inline std::unique_ptr<Simulation> rod_cube() { return simulation_of(rod_cube_deck()); }

}  // namespace mbcosim::server
