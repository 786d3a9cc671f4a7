#include "simulation/linearize.h"

#include <algorithm>
#include <cmath>

#include "solver/system.h"

namespace mbcosim {

namespace {

/// Central differences of the residual and of the outputs.
class Differences {
 public:
  Differences(const Model& model, const State& state, const Variables& variables,
              std::span<const int> outputs)
      : model_(model),
        state_(state),
        variables_(variables),
        outputs_(outputs),
        scratch_(model.scratch),
        phase_(state.step == 0 ? Phase::derivatives : Phase::step) {}

  int output_count() const {
    int count = 0;
    for (const int handle : outputs_) count += variables_.list()[handle].size;
    return count;
  }
  /// Derivatives along a change of the state: change(state, ±step). `residual`: null when it is not
  /// wanted.
  template <class Change>
  void compute(double step, Change&& change, VecX* residual, VecX& outputs) {
    State plus = state_, minus = state_;
    change(plus, step);
    change(minus, -step);
    if (residual) *residual = (residual_of(plus) - residual_of(minus)) / (2 * step);
    outputs = (outputs_of(plus) - outputs_of(minus)) / (2 * step);
  }

 private:
  VecX residual_of(const State& state) {
    std::vector<double> r(model_.unknowns);
    compute_residual(model_.context(state, phase_), scratch_, r);
    return Eigen::Map<const VecX>(r.data(), static_cast<Eigen::Index>(r.size()));
  }
  VecX outputs_of(const State& state) {
    std::vector<double> values;
    const EvalContext context = model_.context(state, phase_);
    for (const int handle : outputs_) variables_.get(context, handle, values);
    return Eigen::Map<const VecX>(values.data(), static_cast<Eigen::Index>(values.size()));
  }

  const Model& model_;
  const State& state_;
  const Variables& variables_;
  std::span<const int> outputs_;
  Scratch scratch_;
  Phase phase_;
};

Error stopped() { return cancelled_error("linearization: stopped"); }

double step_at(double value) { return 1e-6 * std::max(1.0, std::abs(value)); }

}  // namespace

Result<InputsOutputs> linearize_inputs_outputs(const Model& model, const State& state,
                                               const Variables& variables,
                                               std::span<const int> inputs,
                                               std::span<const int> outputs,
                                               const CancelToken* cancel) {
  Differences differences(model, state, variables, outputs);
  int input_count = 0;
  for (const int handle : inputs) input_count += variables.list()[handle].size;
  const int n = model.unknowns, output_count = differences.output_count();
  InputsOutputs io{MatX::Zero(n, input_count), MatX::Zero(output_count, n),
                   MatX::Zero(output_count, n), MatX::Zero(output_count, input_count)};
  VecX residual, output;
  int column = 0;
  for (const int handle : inputs) {
    std::vector<double> values;
    variables.get(model.context(state, Phase::step), handle, values);
    State copy = state;
    if (auto status = variables.set(model, copy, handle, values); !status) return status.error();
    for (std::size_t k = 0; k < values.size(); ++k, ++column) {
      const auto change = [&](State& changed, double step) {
        std::vector<double> moved = values;
        moved[k] += step;
        (void)variables.set(model, changed, handle, moved);
      };
      if (cancel && cancel->cancelled()) return stopped();
      differences.compute(step_at(values[k]), change, &residual, output);
      io.b.col(column) = residual;
      io.d0.col(column) = output;
    }
  }
  for (int i = 0; i < n && output_count > 0; ++i) {
    if (cancel && cancel->cancelled()) return stopped();
    const auto change = [&](std::vector<double> State::*unknowns) {
      return [&model, unknowns, i](State& changed, double step) {
        (changed.*unknowns)[i] += step;
        update_rotations(model, changed);
      };
    };
    differences.compute(step_at(state.y[i]), change(&State::y), nullptr, output);
    io.c0.col(i) = output;
    if (model.kinds[i] != UnknownKind::differential) continue;
    differences.compute(step_at(state.yp[i]), change(&State::yp), nullptr, output);
    io.c1.col(i) = output;
  }
  return io;
}

}  // namespace mbcosim
