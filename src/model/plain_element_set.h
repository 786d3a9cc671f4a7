/// A set whose elements have nothing of what most have.
#pragma once

#include "model/element_set.h"

namespace mbcosim {

/// Its elements own no unknowns, start nothing, take no part in the initial assembly, have no
/// private data, no line of the log and no inertia; sets derived from it say what they do have.
class PlainElementSet : public ElementSet {
 public:
  int unknowns(int) const override { return 0; }
  bool is_differential(int, int) const override { return false; }
  std::string row_name(int, int) const override { return {}; }
  std::vector<int> nodes(int) const override { return {}; }
  int first_own(int) const override { return -1; }
  void bind(const Model&, int, int) override {}
  void collect_pattern(PatternSink&) const override {}
  void append_rows(const Model&, int, std::vector<int>&) const override {}
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
};

}  // namespace mbcosim
