/// Rows that structural nodes contribute themselves: momentum definitions and balances of dynamic
/// nodes.
///
///   rows 1–3:   b   − Σ(m v + w × S)   = 0      (the sums are the bodies')
///   rows 4–6:   g_m − Σ(J w + S × v)   = 0
///   rows 7–9:   −ḃ + Σ f               = 0
///   rows 10–12: −(ġ_m + v × b) + Σ m   = 0      moments about the node
///
/// Displacement nodes have rows 1–3 and 7–9 only. Source: MBDyn input manual and
/// technical manual, structural nodes.
#pragma once

#include <vector>

#include "model/context.h"
#include "model/element_set.h"
#include "model/node.h"

namespace mbcosim {

class NodeEquations {
 public:
  void bind(const std::vector<StructuralNode>& nodes);
  void collect_pattern(PatternSink& sink) const;
  void append_rows(int k, std::vector<int>& rows) const;  ///< those of the k-th node that has any
  void set_positions(const PositionSource& source);
  int size() const { return static_cast<int>(rows_.size()); }
  void residual(const EvalContext& context, double* r, ElementRange range) const;
  void jacobian(const EvalContext& context, double* values, ElementRange range) const;

 private:
  struct Row {
    int first;      ///< first unknown of the node
    bool rotation;  ///< 6 or 3 position unknowns
    int position;   ///< in positions_
  };
  std::vector<Row> rows_;
  std::vector<int> positions_;
};

}  // namespace mbcosim
