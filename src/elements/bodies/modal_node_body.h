/// A rigid body on the node of a modal joint.
#pragma once

#include "elements/bodies/body.h"
#include "elements/general_element.h"

namespace mbcosim {

/// As Body, whose S and J it has; modal nodes have velocities v, w as unknowns in the place of
/// momenta, so that the inertia stands in the balances (about the node, global axes):
///
///   m (a_g − v̇) + S × ẇ − w × (w × S)
///   S × (a_g − v̇) − J ẇ − w × J w
class ModalNodeBody final : public GeneralElement {
 public:
  explicit ModalNodeBody(const Body& body) : body_(body) {}

  const Body& body() const { return body_; }
  void connect(GeneralConnection& c) override { node_ = c.whole_node(body_.node); }
  void pattern(GeneralPattern& p) const override { p.block(node_ + kBalance, 6, node_, 12); }
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView& u, GeneralJacobian& j) const override;

  std::string log(const Model& model, int label) const override { return body_.log(model, label); }
  int private_datum(std::string_view name) const override { return Body::private_datum(name); }
  std::vector<Datum> private_data() const override { return Body::private_data(); }
  double private_value(const GeneralView& u, int datum) const override {
    return body_.value(u.context, u.node(body_.node), datum);
  }
  void add_inertia(const GeneralView& u, int node, Inertia& inertia) const override {
    if (node == body_.node) body_.add_to(inertia, u.node(node).R);
  }

 private:
  static constexpr int kVelocity = 6, kBalance = 6;  ///< columns, rows of the node's
  /// Global axes.
  struct Motion {
    Vec3 S, apparent;  ///< gravity less v̇
    Mat3 J;
    Vec3 w, wp;
  };
  Motion motion(const GeneralView& u) const;

  Body body_;
  int node_ = -1;
};

}  // namespace mbcosim
