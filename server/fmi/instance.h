/// One instance of an FMU of ours: the engine behind the functions of FMI 2 and FMI 3.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "fmi/log.h"
#include "fmi/manifest.h"
#include "fmi/modes.h"
#include "fmi/remote.h"
#include "simulation/load.h"
#include "simulation/point_motion.h"

namespace mbcosim::fmi {

/// All that a step changes, in memory.
struct SavedState {
  std::string token;  ///< of the FMU
  Mode mode = Mode::instantiated;
  std::vector<std::vector<double>> given;  ///< last values of inputs and parameters, by variable
  SymbolValues symbols;                    ///< values of symbols that are not the deck's
  double communication_time = 0, last_time = 0;
  bool ended = false;  ///< the deck ended the run in the last step
  std::optional<double> stop_time;
  std::optional<State> state;  ///< when the start was computed
};

/// FMU time is the importer's: a step ends at the sum of its arguments. The simulation sums its own
/// steps, as `mbcosim run` does; the two differ by rounding.
class Instance {
 public:
  /// Reads the manifest and the deck below `resources` (a folder). null: `log` says why.
  static std::unique_ptr<Instance> create(Standard standard, const std::string& name,
                                          const std::string& token, const std::string& resources,
                                          Log log);

  Standard standard() const { return standard_; }
  Log& log() { return log_; }
  Mode mode() const { return mode_; }
  /// Is the call allowed now? If not: logs it and fails.
  bool admit(Call call, const char* function);
  /// Logs a failure and enters the mode that the standard has for it.
  Status fail(const std::string& message);
  Status discard(const std::string& message);

  Status setup(double start_time, std::optional<double> stop_time);
  Status enter_initialization();
  Status exit_initialization();
  Status terminate();
  Status reset();
  Status get(std::span<const std::uint32_t> references, std::span<double> values);
  Status set(std::span<const std::uint32_t> references, std::span<const double> values);
  /// Symbols of another type than real; the alternative of each value is `type`. `values` is kept
  /// where it lies until the next call of this function (strings of the C interface).
  Status get_symbols(std::span<const std::uint32_t> references, ValueType type,
                     const std::vector<Value>*& values);
  Status set_symbols(std::span<const std::uint32_t> references, ValueType type,
                     const std::vector<Value>& values);
  Status do_step(double time, double length);
  double last_time() const { return last_time_; }  ///< that the last step reached [s]
  bool ended() const { return ended_; }  ///< the deck ended the run there, in the last step

  /// null: the state cannot be had, which is logged.
  std::unique_ptr<SavedState> save();
  Status restore(const SavedState& saved);
  std::string serialize(const SavedState& saved);
  /// null: the bytes are refused, which is logged.
  std::unique_ptr<SavedState> deserialize(std::string_view bytes);

  /// sensitivity = D seed, D = ∂unknowns/∂knowns at constant states; transposed: Dᵀ seed.
  Status derivative(std::span<const std::uint32_t> unknowns, std::span<const std::uint32_t> knowns,
                    std::span<const double> seed, std::span<double> sensitivity, bool transposed);

  /// busy: a call runs, a second one at the same time is refused; freed: no call may begin.
  enum class Use { idle, busy, freed };
  std::atomic<Use> use{Use::idle};

 private:
  struct Variable {
    const FmuVariable* of = nullptr;
    int handle = -1;                      ///< of the simulation
    const PointMotion* motion = nullptr;  ///< of a port's points
  };
  /// Derivatives of numbers, Σ factor × derivative of a number of the simulation.
  struct Sums {
    std::vector<int> handles, starts;  ///< its variables, each once, and where their numbers begin
    int size = 0;                      ///< of them together
    std::vector<std::vector<std::pair<int, double>>> rows;  ///< number, factor; inputs: 1 each

    /// Where the numbers of a variable begin.
    int place_of(int handle, int handle_size);
    void add(int number, double factor);  ///< to the last row
  };
  /// D of all outputs by all inputs of a call, kept while nothing changes.
  struct Derivative {
    std::vector<std::uint32_t> unknowns, knowns;
    std::uint64_t revision = 0;
    MatX d;
  };

  Instance(Standard standard, std::string name, Log log)
      : standard_(standard), name_(std::move(name)), log_(std::move(log)) {}
  bool load(const std::string& token, const std::string& resources);
  /// The deck with these values of symbols; its diagnostics go to the log.
  DeckReport read_with(const SymbolValues& symbols);
  void take(DeckReport report, const SymbolValues& symbols);
  /// Reads the deck again when symbols have got other values.
  mbcosim::Status ensure_read();
  /// The digest of the model with these values of symbols.
  Result<std::uint64_t> digest_with(const SymbolValues& symbols);
  bool bind();
  void set_start_values();
  /// The phases before the first step, with the inputs as given; again when one has changed.
  mbcosim::Status ensure_started();
  const Variable* find(std::uint32_t reference) const;
  const FmuSymbol* find_symbol(std::uint32_t reference, ValueType type) const;
  Value value_of(const FmuSymbol& symbol) const;
  Status may_choose(const FmuSymbol& symbol);
  void choose(const FmuSymbol& symbol, const Value& value);
  int index_of(const Variable& variable) const {
    return static_cast<int>(&variable - variables_.data());
  }
  void read(const Variable& variable, std::vector<double>& all, std::vector<double>& out) const;
  Status may_set(const Variable& variable);
  bool write(const Variable& variable, std::span<const double> values);
  Result<double> advance(double length, double end);
  Result<StepReport> take_step(std::optional<double> end);
  double next_step_size() const;
  Status failed_step(const Error& error, const State& before);
  Status end_run(double time);
  // --- with a daemon: the state here is brought up to date when somebody wants it
  mbcosim::Status ensure_connected();
  mbcosim::Status pull();
  mbcosim::Status push();
  Status check_step(double time, double length);
  mbcosim::Status compute_derivative(std::span<const std::uint32_t> unknowns,
                                     std::span<const std::uint32_t> knowns);
  /// Each number of a call's variables, in turn.
  std::optional<Sums> sums_of(std::span<const std::uint32_t> references, bool inputs);
  void add_motion(const Variable& variable, Sums& sums) const;

  const Standard standard_;
  const std::string name_;
  Log log_;
  Manifest manifest_;
  std::map<std::string, std::string> files_;
  SymbolValues exported_;  ///< symbols whose values were chosen at the export
  SymbolValues chosen_;    ///< those, and what the importer chose
  SymbolValues read_;      ///< with which the deck was read last
  SymbolValues declared_;  ///< what it gave all symbols then
  std::vector<Value> handed_out_;
  double initial_time_ = 0;  ///< of the deck as it was exported [s]
  ModelPtr model_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<Remote> remote_;  ///< takes the steps; null: the simulation does
  bool ahead_ = false;              ///< the daemon's state is later than the simulation's
  bool behind_ = true;              ///< the simulation's state is not the daemon's
  double remote_next_size_ = 0;     ///< [s]; when the daemon is ahead
  std::vector<std::unique_ptr<PointMotion>> motions_;
  std::vector<Variable> variables_;
  std::unordered_map<std::uint32_t, int> index_;
  std::vector<std::vector<double>> given_;
  Mode mode_ = Mode::instantiated;
  bool started_ = false;
  double communication_time_ = 0, last_time_ = 0;
  bool ended_ = false;
  std::optional<double> stop_time_;
  std::uint64_t revision_ = 1;  ///< counts changes of state and inputs
  std::optional<Derivative> derivative_;
};

}  // namespace mbcosim::fmi
