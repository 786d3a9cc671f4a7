/// Modal force: generalized forces on modes of one modal joint, with an optional resultant on its
/// modal node.
///
///   mode j:       + d_j(t)
///   modal node:   force + R Σ f_j d_j,   moment + R Σ m_j d_j      (f_j, m_j in the node's axes)
///
/// Takes no part in the initial assembly. Source: MBDyn input manual, modal force.
#pragma once

#include <vector>

#include "elements/modal/modal_joint.h"
#include "model/drive.h"
#include "model/plain_element_set.h"

namespace mbcosim {

struct ModalForce {
  const ModalJointSet* joints = nullptr;
  int joint = -1;  ///< index in `joints`
  int node = -1;   ///< its modal node, −1 when it is clamped
  struct Term {
    int mode = 0;  ///< among the active modes
    DrivePtr drive;
    Vec3 f = Vec3::Zero(), m = Vec3::Zero();  ///< resultant per unit of the drive
  };
  std::vector<Term> terms;

  /// Σ f_j d_j, Σ m_j d_j in the node's axes.
  VecN<6> resultant(const EvalContext& context) const;
};

class ModalForceSet final : public PlainElementSet {
 public:
  void add(ElementInfo info, ModalForce force) {
    slots_.push_back({std::move(force), std::move(info), {}});
  }

  int size() const override { return static_cast<int>(slots_.size()); }
  const ElementInfo& info(int i) const override { return slots_[i].info; }
  ElementInfo& info(int i) override { return slots_[i].info; }
  std::vector<int> nodes(int i) const override;
  void bind(const Model& model, int, int) override { structural_ = &model.structural; }
  void collect_pattern(PatternSink& sink) const override;
  void append_rows(const Model& model, int i, std::vector<int>& rows) const override;
  void set_positions(const PositionSource& positions) override;
  void residual(const EvalContext& context, double* r, ElementRange range) const override;
  void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                ElementRange range) const override;
  void output(const EvalContext& context, int i, OutputRow& row) const override;

 private:
  struct Slot {
    ModalForce force;
    ElementInfo info;
    std::vector<int>
        positions;  ///< balances of the modal node × g, by columns (6 × 3); empty when clamped
  };
  /// Rows and columns of the block that depends on the orientation; false when there is none.
  bool orientation_block(const Slot& s, int rows[6], int columns[3]) const;

  std::vector<Slot> slots_;
  const std::vector<StructuralNode>* structural_ = nullptr;
};

}  // namespace mbcosim
