#pragma once

#include <vector>

#include "elements/general_element.h"
#include "model/card.h"

namespace mbcosim {

/// A point of a node slides along a chain of three-node beams (`beam slider`). On beam b, −1 ≤ s ≤
/// 1 with s = s_ref − 2b; Nᵢ quadratic shape functions, xᵢ = node i + Rᵢ fᵢ:
///
///   x = Σ Nᵢ xᵢ,  l = Σ Nᵢ′ xᵢ,  f = R f₀,  x_c = x_node + f,  e₁ e₂ e₃ = R Rs
///   unknowns  s_ref, F [N]; classic: m₂, m₃
///   rows      F·l/c, (x_c − x)/c; classic: e₂·l/c, e₃·l/c
///   M = e₂ × l m₂ + e₃ × l m₃ (classic), else 0
///   loads     node (F, M + f × F); beam −w F, −w (M + (x_c − x_a) × F) on beam node a
///
/// The weights w put the load on one beam node, those of the thirds of the beam that d = 1/√3
/// bounds, or within `smearing` of a bound on two, as MBDyn does.
class BeamSlider : public GeneralElement {
 public:
  struct Span {
    int label;            ///< of the beam
    int node[3];          ///< structural node indices
    Vec3 offset[3];       ///< node frames [m]
    Mat3 orientation[3];  ///< of the beam in the node frames, for .log
  };
  int node = -1;
  Vec3 offset = Vec3::Zero();  ///< f₀, node frame [m]
  Mat3 Rs = Mat3::Identity();
  bool classic = false;
  std::vector<Span> spans;
  double s0 = 0;        ///< s_ref at the start
  double smearing = 0;  ///< half width of the passage from one beam node to the next

  void connect(GeneralConnection& c) override;
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView& u, GeneralJacobian& j) const override;
  void start(const GeneralView& u, State& state) const override;
  void after_convergence(const GeneralView& u, State& state) const override;
  std::string row_name(int own) const override;
  std::string log(const Model& model, int label) const override;
  void output(const GeneralView& u, OutputRow& row) const override;

 private:
  struct Place;
  Place place(const GeneralView& u) const;
  int span_at(const GeneralView& u, double s_ref) const;
  void set_weights(double s, Place& p) const;
  void add_tangent_terms(const Place& p, GeneralJacobian& j, int row, const Mat3& by_l) const;
  void add_moment_terms(const Place& p, GeneralJacobian& j, int row, double factor) const;
  void add_loads(const Place& p, GeneralJacobian& j) const;

  int slider_ = 0, own_ = 0;              ///< local numbers
  std::vector<std::array<int, 3>> beam_;  ///< of the nodes of each span
};

void read_beam_slider(Card& card, ElementInfo& info);

}  // namespace mbcosim
