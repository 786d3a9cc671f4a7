#include "simulation/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "model/end_of_run.h"
#include "output/result_writer.h"
#include "simulation/linearize.h"
#include "simulation/state_bytes.h"
#include "simulation/variables.h"
#include "solver/eigenanalysis.h"
#include "solver/inverse_dynamics.h"
#include "solver/step_controller.h"
#include "solver/stepper.h"

namespace mbcosim {

namespace {

Error no_equations_of_motion() {
  return make_error(ErrorKind::precondition, "INVERSE_DYNAMICS",
                    "an inverse dynamics problem prescribes the motion: there is nothing to "
                    "linearize");
}

Error another_model() {
  return make_error(ErrorKind::precondition, "STATE_OF_ANOTHER_MODEL",
                    "the state belongs to another model: its layout differs");
}

/// `a`, from wherever it came, can take the place of `b`, a state of the model: all that a step
/// reads is there.
bool same_layout(const State& a, const State& b) {
  for (const auto array :
       {&State::y, &State::yp, &State::memory, &State::variables, &State::kept_matrix})
    if ((a.*array).size() != (b.*array).size()) return false;
  const auto is_past = [&](const std::vector<double>& y) {
    return y.empty() || y.size() == b.y.size();
  };
  const std::size_t loads = 6 * b.rotation.size();
  return is_past(a.y1) && a.yp1.size() == a.y1.size() && is_past(a.y2) &&
         a.yp2.size() == a.y2.size() && a.rotation.size() == b.rotation.size() &&
         (a.external_loads.empty() || a.external_loads.size() == loads) &&
         a.control.started == b.control.started;
}

}  // namespace

struct Simulation::Impl {
  explicit Impl(ModelPtr m)
      : model(std::move(m)),
        stepper(*model),
        inverse(inverse_problem(*model) ? std::make_unique<InverseDynamics>(*model) : nullptr),
        controller(inverse ? static_cast<StepSystem&>(*inverse) : stepper),
        final_time(model->initial_value.final_time) {}

  ModelPtr model;
  State state;
  Stepper stepper;
  std::unique_ptr<InverseDynamics> inverse;  ///< of an inverse dynamics problem
  StepController controller;
  double final_time;  ///< [s]
  int threads = 1;
  std::shared_ptr<ResultWriter> writer;
  TimeKeeping time_keeping = TimeKeeping::summed;
  const CancelToken* cancel = nullptr;  ///< of the call that is under way
  bool ended = false;                   ///< a drive ended the run before its final time
  std::function<void(StartEvent)> start_observer;
  mutable std::once_flag variables_once;
  mutable std::unique_ptr<Variables> variables;

  const Variables& all_variables() const {
    std::call_once(variables_once, [this] { variables = std::make_unique<Variables>(*model); });
    return *variables;
  }

  /// At an accepted state; also before the first step, when the derivatives phase is over and
  /// accelerations are known.
  EvalContext context() const { return model->context(state, Phase::step); }

  bool meter() const {
    const ControlSettings& c = model->control;
    if (c.output_meter) return c.output_meter->value(context()) != 0;
    return state.step % c.output_frequency == 0;
  }

  bool record() {
    if (!writer || !meter()) return false;
    writer->record(context());
    return true;
  }

  bool at_end() const {
    constexpr double kRounding =
        1e-9;  // of a step: exact times leave no step that rounding alone asks for
    const double margin = state.control.exact_time ? kRounding * state.h : 0;
    return !(state.time < final_time - margin);
  }

  bool is_finished() const {
    return model->initial_value.abort_after != InitialValueSettings::AbortAfter::never || ended ||
           at_end();
  }

  Status start();
  /// Phases between the initial assembly and the first step, with the record of step 0.
  Status start_motion();
  /// A deck that asks for no step: the record of what there is, and `text` in the run log.
  Status end_without_steps(const std::string& text);
  void tell(StartEvent event) const {
    if (start_observer) start_observer(event);
  }
  Status start_inverse();
  PhaseReport run_dummy_steps();
  /// The deck's eigenanalyses with times in (after, until].
  Status analyse_modes(double after, double until);
  StepReport step(const CancelToken* cancel, const StepChoice& choice = {});
  /// As many steps as `next` has choices for.
  template <class Next>
  StepReport run(const CancelToken* cancel, Next&& next);
  /// Shortest length that tells the end of a step from its start [s].
  double shortest() const {
    constexpr double kRelative = 1e-12;
    const InitialValueSettings& s = model->initial_value;
    return kRelative * std::max({std::abs(state.time), std::abs(s.initial_time), s.time_step});
  }
  double next_step_size() const;
  Status check_length(double length) const;
  /// What an accepted step writes: its line and record, and the deck's eigenanalyses.
  Status write(const NewtonReport& newton, double previous_time);
};

/// The report is that of the last one.
PhaseReport Simulation::Impl::run_dummy_steps() {
  PhaseReport report;
  for (int k = 0; k < model->initial_value.dummy_steps; ++k) {
    tell(StartEvent::dummy_step_begins);
    report = controller.advance_by(state,
                                   [&](State& s) { return stepper.attempt_dummy_step(s, k == 0); });
    if (report.error) return report;
    tell(StartEvent::dummy_step_ended);
  }
  stepper.end_dummy_steps(state);
  return report;
}

/// Phases before the first step.
Status Simulation::Impl::start() {
  const InitialValueSettings& s = model->initial_value;
  using AbortAfter = InitialValueSettings::AbortAfter;
  if (writer) {
    if (auto writable = check_writable(writer->paths(*model)); !writable) return writable;
    writer->begin(*model);
    if (auto status = writer->status(); !status) return status;
  }
  if (s.abort_after == AbortAfter::input)
    return end_without_steps("End of Input; no simulation or assembly is required.\n");
  if (inverse) return start_inverse();
  if (auto status = stepper.assemble(state); !status) return status;
  state.control.exact_time = time_keeping == TimeKeeping::exact;
  if (s.abort_after == AbortAfter::assembly || final_time < s.initial_time)
    return end_without_steps("End of Initial Assembly; no simulation is required.\n");
  if (auto status = analyse_modes(-HUGE_VAL, std::nextafter(s.initial_time, -HUGE_VAL)); !status)
    return status;
  tell(StartEvent::assembled);
  return start_motion();
}

Status Simulation::Impl::start_motion() {
  const InitialValueSettings& s = model->initial_value;
  using AbortAfter = InitialValueSettings::AbortAfter;
  PhaseReport report = stepper.solve_derivatives(state);
  if (report.error) {
    record();
    return *report.error;
  }
  tell(StartEvent::derivatives_solved);
  if (writer)
    writer->derivatives(state.time, report.newton.iterations, report.newton.residual_error);
  if (s.abort_after == AbortAfter::derivatives || !(final_time > s.initial_time)) {
    if (writer) writer->samples(context());
    return end_without_steps("End of derivatives; no simulation is required.\n");
  }
  if (auto status = analyse_modes(std::nextafter(s.initial_time, -HUGE_VAL), s.initial_time);
      !status)
    return status;
  StepLine line;
  if (s.dummy_steps > 0) {
    report = run_dummy_steps();
    if (report.error) return *report.error;
    if (writer)
      writer->dummy_steps(state.time, report.newton.iterations, report.newton.residual_error);
    state.step = 0;
    line.h = s.dummy_ratio * s.time_step;
  }
  if (writer) writer->samples(context());
  line.time = state.time + line.h;  // MBDyn tells where another dummy step would end
  line.iterations = report.newton.iterations;
  line.residual_error = report.newton.residual_error;
  line.recorded = record();
  if (!writer) return ok();
  writer->step(line);
  if (s.abort_after == AbortAfter::dummy_steps)
    writer->note("End of dummy steps; no simulation is required.\n");
  return ok();
}

Status Simulation::Impl::end_without_steps(const std::string& text) {
  record();
  if (writer) writer->note(text);
  return ok();
}

/// Inverse dynamics begins with the record at the initial time.
Status Simulation::Impl::start_inverse() {
  inverse->begin(state);
  state.control.exact_time = time_keeping == TimeKeeping::exact;
  const PhaseReport report = inverse->attempt(state, {.h = model->initial_value.time_step});
  if (report.error) return *report.error;
  return write(report.newton, state.time);
}

Status Simulation::Impl::analyse_modes(double after, double until) {
  const std::optional<EigenSettings>& settings = model->initial_value.eigenanalysis;
  if (!writer || !settings) return ok();
  for (std::size_t k = 0; k < settings->times.size(); ++k) {
    const double time = settings->times[k];
    if (!(time > after && time <= until)) continue;
    auto report = mbcosim::analyse_modes(*model, state, *settings, cancel);
    if (!report) return report.error();
    report->index = static_cast<int>(k);
    writer->eigenanalysis(*report);
  }
  return ok();
}

Status Simulation::Impl::write(const NewtonReport& newton, double previous_time) try {
  if (!writer) return ok();
  StepLine line{state.step,
                state.time,
                state.h,
                newton.iterations,
                newton.residual_error,
                newton.solution_error,
                newton.by_solution,
                false};
  line.recorded = record();
  writer->step(line);
  writer->samples(context());
  if (auto status = writer->status(); !status) return status;
  return analyse_modes(previous_time, state.time);
} catch (const EvaluationError& e) {
  return evaluation_failure(state, e);
}

double Simulation::Impl::next_step_size() const try {
  if (!state.control.started) return state.h;  // the deck ends before the first phase
  return stepper.peek_step_size(state);
} catch (const EvaluationError&) {
  return state.h;  // the step itself will say what is wrong
}

Status Simulation::Impl::check_length(double length) const {
  const auto bad = [&](const std::string& what) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", length);
    return make_error(ErrorKind::argument, "BAD_STEP_SIZE",
                      "a step of " + std::string(text) + " s " + what);
  };
  const auto seconds = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g s", value);
    return std::string(text);
  };
  if (!(length > 0) || !std::isfinite(length))
    return bad("is not possible: choose a positive length");
  if (length < shortest())
    return bad("is too short: its end could not be told from its start; at least " +
               seconds(shortest()));
  if (is_finished()) return ok();
  constexpr double kRounding = 1e-9;
  const double left = final_time - state.time;
  if (length > left * (1 + kRounding) && length != next_step_size())  // the deck's own may do that
    return bad("goes beyond the final time; at most " + seconds(left));
  return ok();
}

StepReport Simulation::Impl::step(const CancelToken* cancel, const StepChoice& choice) {
  StepReport report;
  // Dummy steps passed the instants between the initial time and the state without a look at them.
  const double previous_time = state.step == 0 ? model->initial_value.initial_time : state.time;
  const auto begin = std::chrono::steady_clock::now();
  this->cancel = cancel;
  stepper.set_cancelled(cancel);
  if (inverse) inverse->set_cancelled(cancel);
  PhaseReport phase = controller.advance(state, choice);
  report.flagged = phase.flagged;
  report.restarted = phase.restarted;
  report.pieces = phase.pieces;
  report.solver_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report.step = state.step;
  report.time = state.time;
  report.step_size = state.h;
  report.iterations = phase.newton.iterations;
  report.total_iterations = phase.newton.iterations;
  report.residual_error = phase.newton.residual_error;
  report.solution_error = phase.newton.solution_error;
  if (phase.error && phase.error->reason == kEndOfRun) {
    ended = true;
    report.outcome = StepOutcome::finished;
    if (writer)
      writer->note("# The run ends before its final time: " + phase.error->message + "\n");
    return report;
  }
  if (phase.error) {
    report.outcome = phase.error->kind == ErrorKind::cancelled ? StepOutcome::interrupted
                                                               : StepOutcome::not_converged;
    report.error = std::move(phase.error);
    return report;
  }
  report.steps_done = 1;
  if (auto status = write(phase.newton, previous_time); !status) {
    report.outcome = StepOutcome::not_written;
    report.error = status.error();
    report.error->failure.step = state.step;
    report.error->failure.time = state.time;
    return report;
  }
  if (at_end()) report.outcome = StepOutcome::finished;
  return report;
}

Simulation::Simulation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Simulation::~Simulation() = default;

Result<std::unique_ptr<Simulation>> Simulation::create(ModelPtr model, const CancelToken* cancel,
                                                       std::shared_ptr<ResultWriter> writer,
                                                       TimeKeeping time_keeping) {
  auto simulation = prepare(std::move(model), std::move(writer), time_keeping);
  if (auto status = simulation->start(cancel); !status) return status.error();
  return simulation;
}

std::unique_ptr<Simulation> Simulation::prepare(ModelPtr model,
                                                std::shared_ptr<ResultWriter> writer,
                                                TimeKeeping time_keeping) {
  auto impl = std::make_unique<Impl>(std::move(model));
  impl->writer = std::move(writer);
  impl->time_keeping = time_keeping;
  impl->state = make_initial_state(*impl->model);
  return std::unique_ptr<Simulation>(new Simulation(std::move(impl)));
}

Status Simulation::start(const CancelToken* cancel) {
  impl_->cancel = cancel;
  impl_->stepper.set_cancelled(cancel);
  if (impl_->inverse) impl_->inverse->set_cancelled(cancel);
  Status status = ok();
  try {
    status = impl_->start();
  } catch (const EvaluationError& e) {
    status = make_error(ErrorKind::evaluation, "EVALUATION_FAILED",
                        std::string("before the first step: ") + e.what());
  } catch (const Stopped&) {
    status = stopped_within_iteration(impl_->state);
  }
  if (!status && impl_->writer) (void)impl_->writer->finish();
  return status;
}

void Simulation::set_threads(int threads) {
  impl_->threads = threads;
  impl_->stepper.set_threads(threads);
}
void Simulation::set_final_time(double time) { impl_->final_time = time; }

const Model& Simulation::model() const { return *impl_->model; }
const State& Simulation::state() const { return impl_->state; }
std::int64_t Simulation::step_number() const { return impl_->state.step; }
double Simulation::time() const { return impl_->state.time; }

double Simulation::next_step_size() const { return impl_->next_step_size(); }

double Simulation::final_time() const { return impl_->final_time; }

double Simulation::largest_step_size() const { return std::max(0.0, final_time() - time()); }

bool Simulation::finished() const { return impl_->is_finished(); }

void Simulation::set_exchange(std::function<bool(int)> exchange) {
  impl_->stepper.set_exchange(std::move(exchange));
}

void Simulation::set_start_exchange(std::function<bool(int)> exchange,
                                    std::function<void(StartEvent)> observer) {
  impl_->stepper.set_start_exchange(std::move(exchange));
  impl_->start_observer = std::move(observer);
}

void Simulation::set_attempt_ended(std::function<void(bool)> attempt_ended) {
  impl_->controller.set_attempt_ended(std::move(attempt_ended));
}
void Simulation::set_passes(StepPasses passes) { impl_->controller.set_passes(std::move(passes)); }
void Simulation::set_policy(const StepPolicy& policy) { impl_->controller.set_policy(policy); }
const StepPolicy& Simulation::policy() const { return impl_->controller.policy(); }

void Simulation::set_load_tangents(std::vector<LoadTangent> tangents) {
  impl_->stepper.set_tangents(
      tangents.empty() ? nullptr
                       : std::make_unique<TangentSolver>(*impl_->model, std::move(tangents)));
}
LoadTangent& Simulation::load_tangent(int i) { return impl_->stepper.tangents()->tangent(i); }

void StepReport::add(StepReport later) {
  later.steps_done += steps_done;
  later.total_iterations += total_iterations;
  later.solver_seconds += solver_seconds;
  *this = std::move(later);
}

StepReport Simulation::step(const CancelToken* cancel) { return step_many(1, cancel); }

Status Simulation::check(const StepChoice& choice) const {
  if (choice.length && impl_->model->initial_value.strategy == StepStrategy::factor)
    return make_error(ErrorKind::argument, "BAD_STEP_SIZE",
                      "the deck's `strategy: factor` chooses the length of each step");
  if (choice.event && !(choice.within >= impl_->shortest()))
    return make_error(ErrorKind::argument, "BAD_TOLERANCE",
                      "an event cannot be located within " + std::to_string(choice.within) + " s");
  if (choice.end) return impl_->check_length(*choice.end - time());
  return choice.length ? impl_->check_length(*choice.length) : ok();
}

Result<StepReport> Simulation::step(const StepChoice& choice, const CancelToken* cancel) {
  if (auto status = check(choice); !status) return status.error();
  bool done = false;
  return impl_->run(cancel, [&]() -> std::optional<StepChoice> {
    if (std::exchange(done, true) || finished()) return {};
    return choice;
  });
}

template <class Next>
StepReport Simulation::Impl::run(const CancelToken* cancel, Next&& next) {
  StepReport total;
  total.step = state.step;
  total.time = state.time;
  total.step_size = state.h;
  if (is_finished()) total.outcome = StepOutcome::finished;
  while (const std::optional<StepChoice> choice = next()) {
    total.add(step(cancel, *choice));
    if (total.error) break;
  }
  return total;
}

StepReport Simulation::step_many(std::int64_t count, const CancelToken* cancel) {
  return impl_->run(cancel, [&]() -> std::optional<StepChoice> {
    if (count-- <= 0 || finished()) return {};
    return StepChoice{};
  });
}

StepReport Simulation::run_until(double end, const CancelToken* cancel) {
  const bool to_the_end = end >= final_time();
  return impl_->run(cancel, [&]() -> std::optional<StepChoice> {
    if (finished() || (!to_the_end && !(time() + 0.5 * impl_->state.h < end))) return {};
    return StepChoice{};
  });
}

StepReport Simulation::run_exactly_until(double end, const CancelToken* cancel) {
  return impl_->run(cancel, [&] { return next_towards(end); });
}

std::optional<StepChoice> Simulation::next_towards(double end, std::optional<double> length) const {
  constexpr double kRounding = 1e-9;  // of a step: no tiny step is left for the end
  end = std::min(end, final_time());
  const double left = end - time();
  if (finished() || !(left >= impl_->shortest())) return {};
  StepChoice choice;
  const double h = length ? *length : next_step_size();
  if (left <= h * (1 + kRounding))
    choice.end = end;
  else
    choice.length = length;
  return choice;
}

const std::vector<Variable>& Simulation::variables() const { return impl_->all_variables().list(); }
int Simulation::find_variable(const std::string& name) const {
  return impl_->all_variables().find(name);
}
void Simulation::get(int handle, std::vector<double>& out) const {
  const Variables& all = impl_->all_variables();
  const std::size_t before = out.size();
  try {
    all.get(impl_->context(), handle, out);
  } catch (const EvaluationError&) {
    out.resize(before);
    out.resize(before + all.list()[handle].size, std::numeric_limits<double>::quiet_NaN());
  }
}
Status Simulation::set(int handle, std::span<const double> values) {
  const Variables& all = impl_->all_variables();
  if (handle < 0 || handle >= static_cast<int>(all.list().size()))
    return make_error(ErrorKind::argument, "UNKNOWN_HANDLE",
                      "no variable has the handle " + std::to_string(handle));
  return all.set(*impl_->model, impl_->state, handle, values);
}

Status Simulation::restore(const State& state, bool finished) {
  if (!same_layout(state, impl_->state)) return another_model();
  State before = state;
  std::swap(before, impl_->state);
  const Status cut = impl_->writer ? impl_->writer->restored(impl_->context()) : ok();
  if (cut)
    impl_->ended = finished;
  else
    impl_->state = std::move(before);
  return cut;
}

Status Simulation::look_from(const State& state, const std::function<void()>& look) {
  if (!same_layout(state, impl_->state)) return another_model();
  State there = state;
  struct Place {
    Impl& impl;
    State state;
    bool ended;
    ~Place() {
      impl.state = std::move(state);
      impl.ended = ended;
    }
  } const before{*impl_, std::exchange(impl_->state, std::move(there)),
                 std::exchange(impl_->ended, false)};
  look();
  return ok();
}

Status Simulation::write_to(std::shared_ptr<ResultWriter> writer) try {
  impl_->writer = std::move(writer);
  impl_->writer->begin(model());
  impl_->writer->begin_at(step_number(), time());
  impl_->writer->samples(impl_->context());
  impl_->record();
  return impl_->writer->status();
} catch (const EvaluationError& e) {
  return evaluation_failure(state(), e);
}

Status Simulation::resume_writing(std::shared_ptr<ResultWriter> writer) {
  impl_->writer = std::move(writer);
  impl_->writer->resume(model());
  return impl_->writer->restored(impl_->context());
}

Linearization Simulation::linearize() const {
  return mbcosim::linearize(*impl_->model, impl_->state);
}

Result<InputsOutputs> Simulation::linearize(std::span<const int> inputs,
                                            std::span<const int> outputs) const {
  if (impl_->inverse) return no_equations_of_motion();
  return linearize_inputs_outputs(*impl_->model, impl_->state, impl_->all_variables(), inputs,
                                  outputs);
}

Result<Spectrum> Simulation::eigen(int count, std::complex<double> shift) const {
  if (impl_->inverse) return no_equations_of_motion();
  return mbcosim::eigen(linearize(), count, shift);
}

std::string Simulation::export_state() const {
  return state_to_bytes(impl_->state, impl_->model->digest);
}

Result<State> Simulation::state_of(std::string_view bytes) const {
  auto state = state_from_bytes(bytes, impl_->model->digest);
  if (state && !same_layout(*state, impl_->state)) return another_model();
  return state;
}

Status Simulation::import_state(std::string_view bytes, bool finished) {
  auto state = state_of(bytes);
  if (!state) return state.error();
  return restore(*state, finished);
}

std::unique_ptr<Simulation> Simulation::fork(const CancelToken* cancel) const try {
  auto impl = std::make_unique<Impl>(impl_->model);
  impl->threads = impl_->threads;
  impl->stepper.set_threads(impl->threads);
  impl->state = impl_->state;
  // The pivots are chosen on the matrix of the derivatives phase, as in every simulation of this
  // model.
  State start = make_initial_state(*impl->model);
  impl->stepper.set_cancelled(cancel);
  if (!impl->inverse && impl->stepper.assemble(start)) (void)impl->stepper.solve_derivatives(start);
  impl->stepper.set_cancelled(nullptr);
  if (cancel && cancel->cancelled()) return nullptr;
  return std::unique_ptr<Simulation>(new Simulation(std::move(impl)));
} catch (const Stopped&) {
  return nullptr;
}

std::size_t Simulation::factor_bytes() const { return impl_->stepper.factor_bytes(); }

std::int64_t Simulation::factorizations() const {
  return impl_->inverse ? impl_->inverse->factorizations() : impl_->stepper.factorizations();
}

}  // namespace mbcosim
