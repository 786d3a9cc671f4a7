/// Template drives: vectors and matrices that follow drives in time. Forms `null`, `single`,
/// `array`, `component`.
#pragma once

#include <utility>
#include <vector>

#include "math/types.h"
#include "model/drive.h"
#include "model/fwd.h"

namespace mbcosim {

/// Σₖ entityₖ driveₖ(t): `single` (one term), `array` (several) and `null` (none).
template <int R, int C = 1>
class SumTplDrive final : public TplDrive<R, C> {
 public:
  using Value = typename TplDrive<R, C>::Value;
  struct Term {
    Value entity;
    DrivePtr drive;
  };
  explicit SumTplDrive(std::vector<Term> terms) : terms_(std::move(terms)) {}
  Value value(const EvalContext& context) const override;
  bool has_derivative() const override;
  Value derivative(const EvalContext& context) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, Value*& next) const override;

 private:
  std::vector<Term> terms_;
};

/// One drive per component, null where `inactive`; `drives` by columns (R × C).
template <int R, int C = 1>
class ComponentTplDrive final : public TplDrive<R, C> {
 public:
  using Value = typename TplDrive<R, C>::Value;
  explicit ComponentTplDrive(std::vector<DrivePtr> drives) : drives_(std::move(drives)) {}
  Value value(const EvalContext& context) const override;
  bool has_derivative() const override;
  Value derivative(const EvalContext& context) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, Value*& next) const override;

 private:
  std::vector<DrivePtr> drives_;
};

extern template class SumTplDrive<3>;
extern template class SumTplDrive<6>;
extern template class SumTplDrive<3, 3>;
extern template class SumTplDrive<6, 6>;
extern template class ComponentTplDrive<3>;
extern template class ComponentTplDrive<6>;
extern template class ComponentTplDrive<3, 3>;
extern template class ComponentTplDrive<6, 6>;

}  // namespace mbcosim
