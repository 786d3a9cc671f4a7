/// Decks with one or two modal bodies, put together from their parts.
#pragma once

#include <map>
#include <string>

#include "deck_digits.h"
#include "deck_run.h"
#include "elements/modal_bodies.h"
#include "math/rotation.h"

namespace mbcosim::decks {

using mbcosim::digits;
inline std::string digits(const Mat3& m) {
  return "matr, " + digits(Vec3(m.row(0))) + ", " + digits(Vec3(m.row(1))) + ", " +
         digits(Vec3(m.row(2)));
}

/// Motion of a node at the start.
struct Placement {
  Vec3 x = Vec3::Zero();
  Mat3 R = Mat3::Identity();
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();
};

struct ModalDeck {
  double h = 1e-2, final_time = 10, tolerance = 1e-10;
  bool skip_assembly = false;
  std::string initial_value, control;
  std::map<std::string, std::string> files;
  std::string nodes, joints, forces, others;

  void node(int label, const std::string& kind, const Placement& p = {}) {
    nodes += "structural: " + std::to_string(label) + ", " + kind + ", " + digits(p.x) + ", " +
             digits(p.R) + ", " + digits(p.v) + ", " + digits(p.w) + ";\n";
  }
  std::string text() const {
    return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: "
           "0.; final time: " +
           digits(final_time) + "; time step: " + digits(h) +
           "; max iterations: 50; tolerance: " + digits(tolerance) + "; " + initial_value +
           " end: initial value;\nbegin: control data; " +
           (skip_assembly ? "skip initial joint assembly; " : "") + control +
           " end: control data;\nbegin: nodes;\n" + nodes + "end: nodes;\nbegin: elements;\n" +
           joints + forces + others + "end: elements;\n";
  }
  std::map<std::string, std::string> bundle() const {
    std::map<std::string, std::string> all = files;
    all["deck.mbd"] = text();
    return all;
  }
};

/// A run of such a deck, read through private data.
class ModalRun : public DeckRun {
 public:
  explicit ModalRun(const ModalDeck& deck) : DeckRun(deck.bundle()), h_(deck.h) {}
  void to(double t) {
    const int wanted = static_cast<int>(std::lround(t / h_));
    if (wanted > done_) step(wanted - done_);
    done_ = wanted;
  }
  double q(int mode, int joint = 1) const {
    return datum(Family::joint, joint, "q[" + std::to_string(mode) + "]");
  }
  double p(int mode, int joint = 1) const {
    return datum(Family::joint, joint, "qP[" + std::to_string(mode) + "]");
  }
  double p_rate(int mode, int joint = 1) const {
    return datum(Family::joint, joint, "qPP[" + std::to_string(mode) + "]");
  }
  /// Force on interface node k (0, 1, ...) and couple on it, in the node's axes.
  Vec3 force(int modes, int k = 0, int joint = 1) const { return own3(joint, 2 * modes + 6 * k); }
  Vec3 couple(int modes, int k = 0, int joint = 1) const {
    return own3(joint, 2 * modes + 6 * k + 3);
  }
  Vec3 euler_degrees(int label) const { return 180 / M_PI * euler123_of_rotation(node(label).R); }

 private:
  Vec3 own3(int joint, int first) const {
    return Vec3(own(Family::joint, joint, first), own(Family::joint, joint, first + 1),
                own(Family::joint, joint, first + 2));
  }
  double h_;
  int done_ = 0;
};

}  // namespace mbcosim::decks
