/// Simulation: the one class that users of the library touch. src/README.md has the way of a deck
/// through the folders below it.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "elements/ports/attach.h"
#include "input/sources.h"
#include "model/diagnostic.h"
#include "model/limits.h"
#include "model/model.h"
#include "model/state.h"
#include "simulation/variable.h"
#include "solver/cancel.h"
#include "solver/eigen_spectrum.h"
#include "solver/load_tangent.h"
#include "solver/state_space.h"
#include "solver/step_policy.h"

namespace mbcosim {

/// A deck read: the model (null when there are errors) and everything that was found.
struct LoadReport {
  ModelPtr model;
  std::vector<Diagnostic> diagnostics;
  std::string printed;  ///< what `remark`, `print symbol table` printed
  bool ok() const { return model != nullptr; }
};

/// Reads a deck. Never throws; `report.model` is null when any diagnostic is an error. A deck
/// without blocks gives an empty model. `ports` are attached to the deck as it stands; the model's
/// digest covers them. One that does not fit is a diagnostic with code "port".
LoadReport load_deck(const FileSource& files, const std::string& main_file,
                     const Limits& limits = {}, const std::vector<PortAttachment>& ports = {});

enum class StepOutcome {
  accepted,
  finished,       ///< accepted, and the deck's final time is reached
  not_converged,  ///< the state is that of the last accepted step
  interrupted,    ///< as well
  not_written     ///< accepted, but its results could not be written
};

/// What a step (or several) did.
struct StepReport {
  StepOutcome outcome = StepOutcome::accepted;
  std::int64_t steps_done = 0;
  std::int64_t step = 0;      ///< number of the last accepted step
  double time = 0;            ///< its time [s]
  double step_size = 0;       ///< [s]
  int iterations = 0;         ///< linear solves of the last step
  double residual_error = 0;  ///< test value at the end of the last step
  double solution_error = 0;
  std::int64_t total_iterations = 0;
  int pieces = 1;  ///< in which the last step was solved; more than one when StepPolicy::cut had to
  bool restarted = false;  ///< the last step, of a length that a caller chose, was ten times longer
                           ///< than the one before: Crank-Nicolson took the place of the method
  bool flagged = false;  ///< the last step did not converge and was accepted by StepPolicy::accept
  double solver_seconds = 0;   ///< wall time inside the solver
  std::optional<Error> error;  ///< set unless accepted or finished

  /// Goes on with a later report: counts and times add up, the rest is of the last step.
  void add(StepReport later);
};

/// How time goes on. Drives with events at the end of a step (`step`, `ramp`) tell the two apart.
enum class TimeKeeping {
  summed,  ///< t += h, as MBDyn does: its rounding decides on which side of an event a step ends
  exact    ///< t = t₀ + n h while h stays: no drift over any number of steps
};

/// What happens before the first step, for those who exchange loads with it.
enum class StartEvent {
  assembled,           ///< the initial positions and velocities are there
  derivatives_solved,  ///< and accelerations and multipliers
  dummy_step_begins,
  dummy_step_ended
};

/// Writes results while the simulation runs. Implementations: output/text_writer.h,
/// output/netcdf_writer.h.
class ResultWriter;

class Simulation {
 public:
  /// Prepares a run: initial values, initial assembly, derivatives phase, dummy steps. With
  /// `writer`, results go there.
  static Result<std::unique_ptr<Simulation>> create(ModelPtr model,
                                                    const CancelToken* cancel = nullptr,
                                                    std::shared_ptr<ResultWriter> writer = nullptr,
                                                    TimeKeeping time_keeping = TimeKeeping::summed);
  /// The same without the phases before the first step: inputs can be set, then `start` solves
  /// them.
  static std::unique_ptr<Simulation> prepare(ModelPtr model,
                                             std::shared_ptr<ResultWriter> writer = nullptr,
                                             TimeKeeping time_keeping = TimeKeeping::summed);
  /// How many threads may work on the steps of a large model, the caller's among them, also in
  /// simulations forked from this one; before `start`, at first one. Small models are done by the
  /// caller alone. Results are the same bits for every number.
  void set_threads(int threads);
  /// Initial assembly, derivatives phase, dummy steps; once, after `prepare`.
  Status start(const CancelToken* cancel = nullptr);
  ~Simulation();

  const Model& model() const;
  const State& state() const;
  std::int64_t step_number() const;  ///< of the last accepted step; 0 after create
  double time() const;               ///< of the last accepted step [s]
  double next_step_size() const;     ///< [s]; the last one where the deck's drive has no value
  double largest_step_size() const;  ///< that a caller may choose [s]: to the final time
  double final_time() const;         ///< [s]; infinite when there is none
  bool finished() const;             ///< the final time is reached
  /// Another final time than the deck's [s]; infinite: none. Drives go on with the deck's.
  void set_final_time(double time);

  /// One step. On failure the state is that of the last accepted step and `report.error` says why.
  StepReport step(const CancelToken* cancel = nullptr);
  /// One step as the caller chooses. ErrorKind::argument when the length is no positive number, too
  /// short to tell its end from its start or longer than `largest_step_size` without being the
  /// deck's own, and when the deck's strategy is `factor`, whose lengths follow its own iterations;
  /// nothing is done then.
  Result<StepReport> step(const StepChoice& choice, const CancelToken* cancel = nullptr);
  /// What `step` would refuse.
  Status check(const StepChoice& choice) const;
  /// For loads that depend on the iterate: `exchange` is called before each residual of a step with
  /// the number of corrections so far. `get` then gives values at the iterate and `set` changes
  /// inputs of this iteration; false: the loads have not settled and the iteration goes on. What it
  /// throws leaves `step`, and the state is that of the last accepted step. Empty: none.
  void set_exchange(std::function<bool(int)> exchange);
  /// The same in the derivatives phase, and what happens around it; before `start`. Every attempt
  /// at the phase begins with zero corrections and with the inputs that it found.
  void set_start_exchange(std::function<bool(int)> exchange,
                          std::function<void(StartEvent)> observer);
  /// Called when an attempt at a step failed and another follows (false), and after each piece of a
  /// cut step but the last (true); state and time are those at which the next attempt starts.
  /// Empty: none.
  void set_attempt_ended(std::function<void(bool)> attempt_ended);
  /// Steps are redone until what is outside agrees; results are written of the last pass alone.
  /// What its callbacks throw leaves `step`, and the state is that of the last accepted step.
  /// Empty: none.
  void set_passes(StepPasses passes);
  void set_policy(const StepPolicy& policy);
  const StepPolicy& policy() const;
  /// Derivatives of the loads that `exchange` sets; see solver/load_tangent.h. Empty: none. They
  /// are filled through `load_tangent` from within `exchange`.
  void set_load_tangents(std::vector<LoadTangent> tangents);
  LoadTangent& load_tangent(int i);
  StepReport step_many(std::int64_t count, const CancelToken* cancel = nullptr);
  /// Steps until `time` (within half a step) or the deck's final time.
  StepReport run_until(double time, const CancelToken* cancel = nullptr);
  /// Steps until `time` or the deck's final time, to the bit: the last step is shortened.
  StepReport run_exactly_until(double time, const CancelToken* cancel = nullptr);
  /// The next step of a run that ends at `time` to the bit, in steps of `length` [s] (the deck's
  /// when there is none). Nothing when the time is reached.
  std::optional<StepChoice> next_towards(double time, std::optional<double> length = {}) const;

  const std::vector<Variable>& variables() const;
  int find_variable(const std::string& name) const;  ///< handle or -1
  /// Appends the values of a variable to `out`; NaN where a drive or law cannot be evaluated.
  void get(int handle, std::vector<double>& out) const;
  /// Sets an input variable (parameter nodes, attached loads). ErrorKind::argument when it is not
  /// writable or of the wrong size.
  Status set(int handle, std::span<const double> values);

  /// E and A about the current state.
  Linearization linearize() const;
  /// Derivatives with respect to the inputs and of the outputs (handles) that go with it.
  /// ErrorKind::argument when a handle is not an input.
  Result<InputsOutputs> linearize(std::span<const int> inputs, std::span<const int> outputs) const;
  /// The `count` eigenvalues nearest to `shift` [1/s] about the current state; 0: all finite ones.
  /// ErrorKind::limit when all of a large model are asked for.
  Result<Spectrum> eigen(int count = 0, std::complex<double> shift = 0) const;

  State snapshot() const { return state(); }
  /// ErrorKind::precondition when `state` has another model's layout. The writer is told; when it
  /// cannot follow, nothing changes. `finished`: the run was over there, be it before its final
  /// time; else a drive that ended it is asked anew.
  Status restore(const State& state, bool finished = false);
  /// Stands at `state` while `look` runs, and then where it was. Results are not told. The same
  /// error as `restore`.
  Status look_from(const State& state, const std::function<void()>& look);
  /// Results go there from now on, beginning with the present state.
  Status write_to(std::shared_ptr<ResultWriter> writer);
  /// The same with files that an earlier process wrote, which are cut back to the present step.
  Status resume_writing(std::shared_ptr<ResultWriter> writer);
  /// Versioned bytes with the model's digest and a checksum.
  std::string export_state() const;
  /// ErrorKind::data_loss for damaged bytes, ErrorKind::precondition for another model's.
  /// `finished`: as in `restore`.
  Status import_state(std::string_view bytes, bool finished = false);
  /// The state that `import_state` would take; the simulation stays as it is.
  Result<State> state_of(std::string_view bytes) const;
  /// A new simulation at the same state, sharing the model. Without a writer. It chooses pivots of
  /// its own, which may take as long as a step; null: that was cancelled.
  std::unique_ptr<Simulation> fork(const CancelToken* cancel = nullptr) const;
  /// Memory that factorizations take [bytes]; it may change with a step.
  std::size_t factor_bytes() const;
  /// Matrices that iterations have factored since this object was made.
  std::int64_t factorizations() const;

 private:
  struct Impl;
  explicit Simulation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbcosim
