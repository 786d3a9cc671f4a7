/// Parts of a model that only their makers and few users know.
#pragma once

#include "model/model.h"

namespace mbcosim {

/// Data kept among the model's sets of elements, as a set without elements: fixed once the deck is
/// read, like all of the model.
template <class Data>
class ModelPart final : public ElementSet {
 public:
  Data data;

  int size() const override { return 0; }
  const ElementInfo& info(int) const override { return none_; }
  ElementInfo& info(int) override { return none_; }
  int unknowns(int) const override { return 0; }
  bool is_differential(int, int) const override { return false; }
  std::string row_name(int, int) const override { return {}; }
  std::vector<int> nodes(int) const override { return {}; }
  int first_own(int) const override { return -1; }
  void bind(const Model&, int, int) override {}
  void collect_pattern(PatternSink&) const override {}
  void set_positions(const PositionSource&) override {}
  void start(const EvalContext&, State&, int) const override {}
  void residual(const EvalContext&, double*, ElementRange) const override {}
  void jacobian(const EvalContext&, const NodeSeeds*, double*, ElementRange) const override {}
  void after_predict(const EvalContext&, State&, ElementRange) const override {}
  void after_convergence(const EvalContext&, State&, ElementRange) const override {}
  AssemblyRole assembly_role(int) const override { return AssemblyRole::none; }
  void assembly_residual(const EvalContext&, int, double*, double*) const override {}
  void assembly_jacobian(const EvalContext&, int, int, std::vector<Triplet>&) const override {}
  void output(const EvalContext&, int, OutputRow&) const override {}
  std::string log_line(const Model&, int) const override { return {}; }
  int private_datum(int, std::string_view) const override { return -1; }
  std::vector<Datum> private_data(int) const override { return {}; }
  double private_value(const EvalContext&, int, int) const override { return 0; }
  void add_inertia(const EvalContext&, int, int, Inertia&) const override {}
  void add_momentum(const EvalContext&, int, State&) const override {}

 private:
  ElementInfo none_;
};

/// The part of the model being built, made when it is not there yet.
template <class Data>
Data& part(ModelBuilder& builder) {
  return builder.set<ModelPart<Data>>().data;
}

/// Null when the model has no such part.
template <class Data>
const Data* find_part(const Model& model) {
  for (const auto& set : model.sets)
    if (set->size() == 0)  // a cheap look first: this is asked in every step
      if (const auto* found = dynamic_cast<const ModelPart<Data>*>(set.get())) return &found->data;
  return nullptr;
}

}  // namespace mbcosim
