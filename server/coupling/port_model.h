/// The engine's side of a port: which variables it reads and writes, and in which form they travel.
#pragma once

#include <string>
#include <vector>

#include "coupling/agreement.h"
#include "mbcosim/v1/coupling_types.pb.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// Structural: motion of points xᵢ = x + R fᵢ out; forces F and moments M about the points in,
/// applied to the nodes as F and M + (R fᵢ) × F. Signal: any variables out, inputs in. Answers are
/// kept in global components.
class PortModel {
 public:
  /// Resolves labels and names. Throws Refusal that names what does not exist.
  PortModel(const v1::PortDefinition& definition, const Simulation& simulation);
  /// A port of the deck. Its loads are held by an element, which turns their arms with the nodes.
  PortModel(const StructuralPort& port, const Simulation& simulation);
  /// A stream of the deck: nothing out, its values in. Optional: without a peer it holds its
  /// values.
  PortModel(const StreamInput& stream, const Simulation& simulation);

  const std::string& name() const { return layout_.name(); }
  const v1::PortLayout& layout() const { return layout_; }
  bool offers_accelerations() const;
  /// Does the deck want accelerations sent whatever the peer says?
  bool needs_accelerations() const { return needs_accelerations_; }
  /// Numbers in an answer: 6 for each node, or the inputs' sizes.
  int answer_size() const { return answer_size_; }
  /// Handles that the port writes.
  const std::vector<int>& written() const { return written_; }

  /// Motion or signals at the simulation's state. Keeps what is needed to decode the answer.
  void fill(const Simulation& simulation, const Agreement& agreement, v1::ServerExchange* out);
  /// An answer in global components; empty text, or what is wrong with it.
  std::string decode(const v1::PeerExchange& in, const Agreement& agreement,
                     std::vector<double>* answer) const;
  void apply(const std::vector<double>& answer, Simulation& simulation) const;
  /// The answer that is in force at the simulation's state, where that can be told; else zero.
  Eigen::VectorXd applied(const Simulation& simulation) const;

 private:
  struct Point {
    int x, R, v, w, a = -1, wp = -1, load = -1;  ///< handles; negative: the node has none
    Vec3 offset = Vec3::Zero();                  ///< node frame [m]
  };
  struct Motion {
    Vec3 x, v, w, a = Vec3::Zero(), wp = Vec3::Zero();
    Mat3 R;
    Vec3 arm;  ///< R f, global [m]
  };
  Point find_point(const Simulation& simulation, int label) const;
  void make_structural(const v1::PortDefinition& definition, const Simulation& simulation);
  void make_signal(const v1::PortDefinition& definition, const Simulation& simulation);
  Motion motion(const Simulation& simulation, const Point& point) const;
  void make_relative(Motion& motion) const;
  void decode_loads(const v1::PeerExchange& in, const Agreement& agreement,
                    std::vector<double>* answer) const;
  Mat3 to_global(const Agreement& agreement, std::size_t point) const;
  std::string check_loads(const v1::PeerExchange& in) const;
  void make_reference(const Simulation& simulation, int label);
  std::vector<double> node_loads(const std::vector<double>& answer) const;

  v1::PortLayout layout_;
  std::vector<Point> points_;
  std::vector<int> outputs_, inputs_, written_;
  int answer_size_ = 0;
  int deck_loads_ = -1;  ///< handle of a deck's port; negative: loads go to the nodes
  bool has_reference_ = false, needs_accelerations_ = false;
  Point reference_{};
  std::vector<Motion> sent_;  ///< global, of the last `fill`
  Motion sent_reference_{};
};

}  // namespace mbcosim::server
