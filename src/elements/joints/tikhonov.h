#pragma once

#include "model/plain_element_set.h"
#include "model/registry.h"

namespace mbcosim {

/// Regularization of a joint: each row k of its unknowns λₖ gets + εₖ λₖ/c (in the initial assembly
/// + εₖ λₖ), so that redundant constraints leave a matrix that can be factored. With the sign of
/// the rows of this program, which are those of the reference solver; whether the joint yields or
/// is driven away depends on it. It adds to rows of another element, hence a set of its own and not
/// an ElementSetOf.
///
/// The word `dynamic` of the reference solver takes λₖ of the residual evaluated before: where the
/// iteration has converged both are equal, so that it is served by the same equations.
class TikhonovSet final : public PlainElementSet {
 public:
  /// `matrix_only`: the constraints stay exact, Newton's matrix is regularized.
  void add(ElementInfo info, ElementRef joint, std::vector<double> coefficients, bool matrix_only);
  /// The coefficients of a joint's regularization (unknowns of the joint); empty without one.
  std::vector<double> coefficients(ElementRef joint) const;

  int size() const override { return static_cast<int>(slots_.size()); }
  const ElementInfo& info(int i) const override { return slots_[i].info; }
  ElementInfo& info(int i) override { return slots_[i].info; }
  void bind(const Model& model, int i, int first_own) override;
  void collect_pattern(PatternSink& sink) const override;
  void append_rows(const Model& model, int i, std::vector<int>& rows) const override;
  void set_positions(const PositionSource& positions) override;

  void residual(const EvalContext& context, double* r, ElementRange range) const override;
  void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                ElementRange range) const override;

  AssemblyRole assembly_role(int) const override { return AssemblyRole::custom; }
  void assembly_residual(const EvalContext& context, int i, double* r,
                         double* r_rate) const override;
  void assembly_jacobian(const EvalContext& context, int i, int n,
                         std::vector<Triplet>& out) const override;

 private:
  struct Slot {
    ElementInfo info;
    ElementRef joint;
    std::vector<double> epsilon;  ///< ε (unknowns of the joint)
    bool matrix_only;
    std::vector<char> differential;  ///< (unknowns of the joint)
    std::vector<int> rows;           ///< those unknowns
    std::vector<int> positions;
  };
  std::vector<Slot> slots_;
};

/// `joint regularization : <joint label> , { tikhonov | dynamic | jacobian } [ , { list , <ε1> , …
/// | <ε> } ]
/// ;`
void register_tikhonov(Registry& registry);

}  // namespace mbcosim
