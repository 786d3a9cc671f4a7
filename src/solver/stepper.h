/// Time stepping: the phases of a run and one attempt at a step.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "model/model.h"
#include "solver/cancel.h"
#include "solver/integrator.h"
#include "solver/newton.h"
#include "solver/step_controller.h"
#include "solver/third_order.h"
#include "solver/workspace.h"

namespace mbcosim {

class Stepper final : public StepSystem {
 public:
  explicit Stepper(const Model& model);

  /// `cancel` is asked between iterations and, by throwing Stopped, while a matrix is factored; may
  /// be null.
  void set_cancelled(const CancelToken* cancel);

  /// Called before each residual of a step with the number of corrections so far; false: loads from
  /// outside have not settled. May be empty. What it throws leaves the attempt.
  void set_exchange(std::function<bool(int)> exchange) { exchange_ = std::move(exchange); }
  /// The same in the derivatives phase, where an attempt with another coefficient starts from zero
  /// corrections and from the loads at the start of the phase.
  void set_start_exchange(std::function<bool(int)> exchange) {
    start_exchange_ = std::move(exchange);
  }

  /// Derivatives of the loads that `exchange` sets; none: nullptr.
  void set_tangents(std::unique_ptr<TangentSolver> tangents);
  TangentSolver* tangents() { return workspace_.tangents.get(); }

  /// Initial assembly. The state comes from make_initial_state.
  Status assemble(State& state);
  /// Momenta, accelerations and multipliers at the initial time, after `assemble`.
  PhaseReport solve_derivatives(State& state);
  /// One of the `dummy steps`: short steps before the first regular one. On failure the state is
  /// anywhere.
  PhaseReport attempt_dummy_step(State& state, bool first);
  /// After the last one: the first regular step has the deck's length.
  void end_dummy_steps(State& state) const;

  double next_step_size(State& state) const override;
  double peek_step_size(const State& state) const override;
  double retry_step_size(State& state, double h) const override;
  bool can_retry() const override;
  PhaseReport attempt(State& state, const StepAttempt& attempt) override;
  void explain(PhaseReport& report, const State& state) override;
  void keep(const State& state, State& start) const override {
    copy_state(state, start, workspace_.team());
  }

  /// As Workspace::set_threads.
  void set_threads(int threads) { workspace_.set_threads(threads); }
  Workspace& workspace() { return workspace_; }
  std::size_t factor_bytes() const;     ///< memory of the factorizations
  std::int64_t factorizations() const;  ///< by iterations so far

 private:
  /// Those of the bodies, to the nodes.
  void add_momenta(State& state) const;
  /// Pivots for all regular steps, from the matrix at the initial state: the same in every
  /// simulation of a model.
  void choose_pivots(const State& state);
  /// Activity of `driven` elements makes matrices of different kinds: each has pivots from the
  /// matrix at the initial state with these elements active. Not for third-order steps, see there.
  void select_pivots(const State& state);
  class StepHooks;
  class DerivativesHooks;
  /// One step by a method; the first one by Crank-Nicolson. On failure the state is anywhere.
  PhaseReport attempt(State& state, const StepAttempt& attempt, const MethodSettings& method,
                      bool first, const NewtonSettings& settings);
  /// Ends the prediction's history at the accepted step and begins one of the attempt's length.
  void begin_step(State& state, const StepAttempt& attempt, bool restart) const;
  /// Newton on the prediction, by the method of the step.
  NewtonReport iterate(State& state, const StepFormula& f, const MethodSettings& method, bool first,
                       NewtonSettings settings);
  /// Steps since the strategy last changed the length.
  struct SinceChange {
    std::int64_t reduction, raise;
  };
  double step_size(const State& state, SinceChange& since) const;
  /// From which the strategy goes on [s].
  double strategy_length(const State& state) const;
  ThirdOrderFormula third_order(const State& state, const MethodSettings& method) const;
  StepFormula formula(State& state, double h, const MethodSettings& method, bool first) const;
  void predict(State& state, const StepFormula& formula) const;
  /// Rotation unknowns of the last two accepted steps of node k, relative to the last orientation.
  void refer_to_accepted(State& state, int k) const;
  void finish_prediction(State& state) const;
  void after_convergence(State& state, Phase phase, double c, double ca);
  bool evaluate_matrix(const State& state);
  Error failure(const NewtonReport& report, const State& state, const char* phase) const;

  const Model& model_;
  Workspace workspace_;
  State pivot_state_;  ///< the initial state, when there are `driven` elements; else empty
  std::vector<ElementRef> driven_;
  std::vector<bool> activity_;                  ///< (driven_)
  std::unique_ptr<TwoStageSystem> two_stages_;  ///< when a method of the deck needs it
  const CancelToken* cancel_ = nullptr;
  std::function<bool(int)> exchange_, start_exchange_;
  NewtonSettings regular_, derivatives_, dummy_;
  double derivatives_coefficient_ = 0;
};

}  // namespace mbcosim
