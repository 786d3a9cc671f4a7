/// The engine's side of a port: which variables it reads and writes, and in which form they travel.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "coupling/agreement.h"
#include "mbcosim/v1/coupling_types.pb.h"
#include "model/expression.h"
#include "model/model_part.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// What a peer answered, in global components; loads that follow their nodes in the agreed frame.
struct Answer {
  std::vector<double> values;
  bool unfinished = false;  ///< the peer's own iteration goes on
  bool has_tangent = false;
  MatX stiffness, damping;  ///< of LoadTangent; empty: zero
};

/// Structural: motion of points xᵢ = x + R fᵢ out; forces F and moments M about the points in,
/// applied to the nodes as F and M + (R fᵢ) × F. Mapped: H x and H v out, F̂ in, F = Hᵀ F̂. Motion:
/// reactions out, x and R in. Modal: q, q̇ out, generalized forces in. Signal: any variables out,
/// inputs in.
class PortModel {
 public:
  /// Resolves labels and names. Throws Refusal that names what does not exist.
  PortModel(const v1::PortDefinition& definition, const Simulation& simulation);
  /// A port of the deck. Its loads are held by an element, which turns their arms with the nodes.
  PortModel(const StructuralPort& port, const Simulation& simulation);
  /// A stream of the deck: nothing out, its values in. Optional: without a peer it holds its
  /// values.
  PortModel(const StreamInput& stream, const Simulation& simulation);
  /// A port that an element of the model is.
  PortModel(const PortElementRef& element, const Simulation& simulation);

  const std::string& name() const { return layout_.name(); }
  const v1::PortLayout& layout() const { return layout_; }
  /// Without a peer it holds its inputs, as long as none has attached.
  void make_optional() { layout_.set_optional(true); }
  bool offers_accelerations() const;
  /// Does the deck want accelerations sent whatever the peer says?
  bool needs_accelerations() const { return needs_accelerations_; }
  bool is_mapped() const { return element_ && element_->element->mapping(); }
  bool is_motion() const { return layout_.kind() == v1::PORT_KIND_MOTION; }
  /// Can derivatives of the loads join the solver's matrix?
  bool takes_tangents() const;
  /// Numbers in an answer: 6 for each node, or the inputs' sizes.
  int answer_size() const { return answer_size_; }
  /// The system that the deck is written in; null: not declared.
  const UnitSystem* units() const { return units_; }
  /// For a peer that counts in other units; the deck must have declared its own. Throws
  /// BAD_ARGUMENT for a signal whose unit is unknown.
  UnitConversion conversion(const UnitSystem& peer) const;
  /// Names these units in a layout.
  void tell_units(const UnitSystem& units, v1::PortLayout* out) const;
  /// Handles that the port writes.
  const std::vector<int>& written() const { return written_; }

  /// Motion or signals at the simulation's state. Keeps what is needed to decode the answer.
  void fill(const Simulation& simulation, const Agreement& agreement, v1::ServerExchange* out);
  /// Empty text, or what is wrong with the answer.
  std::string decode(const v1::PeerAnswer& in, const Agreement& agreement, Answer* answer) const;
  /// Where derivatives of the answer enter the equations. Empty: the port has none.
  LoadTangent tangent(const Agreement& agreement) const;
  void apply(const std::vector<double>& answer, Simulation& simulation) const;
  /// Of loads that follow their nodes, turned by the present orientations.
  void apply_following(std::vector<double> answer, const Agreement& agreement,
                       Simulation& simulation) const;
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
  void add_output(const std::string& name, SignalUnit unit);
  void add_input(const std::string& name, SignalUnit unit);
  Point find_point(const Simulation& simulation, int label) const;
  void make_structural(const v1::PortDefinition& definition, const Simulation& simulation);
  void make_signal(const v1::PortDefinition& definition, const Simulation& simulation);
  void make_expression(const v1::OutputExpression& definition, const Simulation& simulation);
  void put_reactions(const Simulation& simulation, v1::ServerExchange* out) const;
  void put_expressions(const Simulation& simulation, v1::ServerExchange* out) const;
  Motion motion(const Simulation& simulation, const Point& point) const;
  void make_relative(Motion& motion) const;
  void take_loads(const v1::PeerAnswer& in, std::vector<double>* answer) const;
  void turn_loads(const Agreement& agreement, const std::vector<Motion>& points,
                  const Motion& reference, std::vector<double>* answer) const;
  std::string check_loads(const v1::PeerAnswer& in, bool moments) const;
  void make_reference(const Simulation& simulation, int label);
  void make_points(const Simulation& simulation, const StructuralPort& port);
  void make_motion(const Simulation& simulation);
  void make_modal(const Simulation& simulation);
  void make_mapped(const Simulation& simulation);
  void make_output();
  void put_motion(const Motion& m, const Agreement& agreement, v1::ServerExchange* out) const;
  void put_reference(const Agreement& agreement, v1::ServerExchange* out) const;
  void fill_mapped(const Agreement& agreement, v1::ServerExchange* out) const;
  std::string decode_own(const v1::PeerAnswer& in, const Agreement& agreement,
                         Answer* answer) const;
  std::string decode_motion(const v1::PeerAnswer& in, const Agreement& agreement,
                            Answer* answer) const;
  std::string decode_tangent(const v1::PeerAnswer& in, const Agreement& agreement,
                             Answer* answer) const;
  void move_to_nodes(const v1::PeerAnswer& in, const Agreement& agreement, Answer* answer) const;
  bool has_signals() const {
    return layout_.kind() == v1::PORT_KIND_SIGNAL || layout_.kind() == v1::PORT_KIND_MODAL;
  }
  int peer_points() const;
  std::vector<double> node_loads(const std::vector<double>& answer) const;

  v1::PortLayout layout_;
  std::vector<Point> points_;
  struct Formula {
    ExpressionPtr expression;
    std::vector<std::pair<int, int>> arguments;  ///< handle and component of each
  };
  std::vector<int> outputs_, inputs_, written_;
  std::vector<Formula> formulas_;  ///< outputs after `outputs_`
  int answer_size_ = 0;
  int deck_loads_ =
      -1;  ///< handle of the inputs of a port in the model; negative: loads go to the nodes
  int reactions_ = -1;  ///< motion: handle of the reactions
  std::optional<PortElementRef> element_;
  const Model* model_;
  const UnitSystem* units_ = find_part<UnitSystem>(*model_);
  std::vector<SignalUnit> output_units_, input_units_;  ///< one for each name in the layout
  bool has_reference_ = false, needs_accelerations_ = false;
  Point reference_{};
  std::vector<Motion> sent_;  ///< global, of the last `fill`
  Motion sent_reference_{};
};

}  // namespace mbcosim::server
