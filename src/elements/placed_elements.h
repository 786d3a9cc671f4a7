/// What the sets of all element types share: where their elements stand in the model, and what is
/// worked out from their local vectors and matrices without knowing the type.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include "elements/element_view.h"

namespace mbcosim {

class PlacedElements : public ElementSet {
 public:
  /// What evaluations read of an element besides its parameters.
  struct Place {
    Connection connection{};
    const ElementInfo* info = nullptr;
    int activity = -1;                       ///< flag of a `driven` element in State::memory
    int first_row = 0, row_count = 0;        ///< in rows_
    int first_column = 0, column_count = 0;  ///< in columns_
    int first_entry = 0, entry_count = 0;    ///< in entries_
    int first_run = 0, run_count = 0;        ///< in runs_
  };

  const ElementInfo& info(int i) const override { return infos_[i]; }
  ElementInfo& info(int i) override { return infos_[i]; }
  int unknowns(int i) const override { return place(i).connection.own_count; }
  bool is_differential(int i, int k) const override {
    return place(i).connection.own_differential[k];
  }
  std::string row_name(int i, int k) const override;
  std::vector<int> nodes(int i) const override;
  int first_own(int i) const override { return place(i).connection.own; }
  int first_sum(int i) const override { return place(i).connection.sums; }

  void bind(const Model& model, int i, int first_own) override;
  void find_structure(const std::vector<StructureProbe>& probes) override;
  void collect_pattern(PatternSink& sink) const override;
  void append_rows(const Model& model, int i, std::vector<int>& rows) const override;
  /// Entries that follow each other in the local matrix and among the sparse values become one run.
  void set_positions(const PositionSource& source) override;

  /// What the element at `p` sees.
  void gather(const EvalContext& context, const Place& p, Local<double>& u) const;

  void assembly_residual(const EvalContext& context, int i, double* r,
                         double* r_rate) const override;
  /// Central differences on local values: the assembly is done once, and Newton needs no more than
  /// these.
  void assembly_jacobian(const EvalContext& context, int i, int n,
                         std::vector<Triplet>& out) const override;

 protected:
  /// What is the same for all elements of the type (element.h).
  struct Traits {
    bool parameters, momentum, constant_structure;
  };
  static constexpr int kRows = kMaxLocal + 6 * kMaxNodes;
  static constexpr int kMatrix = kRows * kMaxLocal;
  static_assert(kMatrix <= std::numeric_limits<std::uint16_t>::max());

  explicit PlacedElements(const Traits& traits) : traits_(traits) {}
  virtual const Place& place(int i) const = 0;
  virtual Place& place(int i) = 0;
  /// Local matrix (row_count × column_count, column-major); `u` is scratch.
  virtual void local_matrix(const EvalContext& context, int i, const NodeSeeds* seeds,
                            Local<double>& u, double* matrix) const = 0;
  /// Local rows and their time derivatives (row_count each) in the initial assembly.
  virtual void assembly_rows(int i, const Local<double>& u, double* rows, double* rates) const = 0;

  const ElementInfo* keep(ElementInfo info);
  bool active(const EvalContext& context, const Place& p) const {
    return p.activity < 0 || context.state->memory[p.activity] != 0;
  }
  /// Adds local rows to the model's.
  void scatter(const Place& p, const Residual<double>& local, double* r) const;
  void inactive_residual(const EvalContext& context, const Place& p, double* r) const;
  void inactive_matrix(const EvalContext& context, const Place& p, double* matrix) const;
  /// Adds a local matrix to the sparse values.
  void add_matrix(const Place& p, const double* matrix, double* values) const;

 private:
  /// Consecutive entries of a local matrix and their places among the sparse values.
  struct Run {
    int position;
    std::uint16_t local, count;
  };
  template <class Function>
  void for_each_entry(const Place& p, Function function) const;
  std::vector<bool> vanishing(int i, const std::vector<StructureProbe>& probes) const;

  const Traits traits_;
  std::deque<ElementInfo> infos_;
  std::vector<int> rows_, columns_;
  std::vector<int> entries_;  ///< local indices; until the positions are known
  std::vector<Run> runs_;
};

}  // namespace mbcosim
