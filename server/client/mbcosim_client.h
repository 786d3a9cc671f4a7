/// Client library: drive a simulation on an mbcosim server, and take part in it as a coupled peer.
/// No gRPC type appears here.
///
///   namespace client = mbcosim::client;
///   client::Server server = client::Server::connect("unix:/run/user/1000/mbcosim.sock");
///   client::Simulation beam = server.load("beam.mbd", {.ports = {{.name = "tip", .nodes = {2}}}});
///   const auto spring = [](const client::Motion& motion) { return client::Loads{…}; };
///   client::Peer peer = beam.couple("tip", spring, {.mode = client::Mode::tight});
///   beam.run_until(1.0);
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "client/mbcosim_events.h"
#include "client/mbcosim_geometry.h"

namespace mbcosim::client {

/// Bounds on the time that a call may take [s]. A call that takes longer throws Error with code 4;
/// one whose server is stopped or cannot be reached any more throws Error with code 14 within 25 s,
/// whatever its bound.
constexpr double kUsual = 30;   ///< default of calls that advance nothing
constexpr double kEndless = 0;  ///< as long as the server lives

/// A finding about a deck.
struct Diagnostic {
  enum Severity { error, warning, note };
  Severity severity = error;
  std::string code, file, message, hint, source_line;
  int line = 0, column = 0;  ///< from 1; 0: not about a place
};

/// A call was refused or failed.
class Error : public std::runtime_error {
 public:
  Error(const std::string& message, int code, std::string reason,
        std::map<std::string, std::string> metadata, std::string field = {},
        std::vector<Diagnostic> diagnostics = {})
      : std::runtime_error(message),
        code_(code),
        reason_(std::move(reason)),
        metadata_(std::move(metadata)),
        field_(std::move(field)),
        diagnostics_(std::move(diagnostics)) {}
  int code() const { return code_; }  ///< of the call, as in gRPC: 5 is NOT_FOUND
  const std::string& reason() const {
    return reason_;
  }  ///< "WRONG_STEP", …; empty: the server gave none
  const std::map<std::string, std::string>& metadata() const { return metadata_; }
  const std::string& field() const {
    return field_;
  }  ///< of the request that is at fault, or empty
  /// Of a deck that was refused.
  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

 private:
  int code_;
  std::string reason_;
  std::map<std::string, std::string> metadata_;
  std::string field_;
  std::vector<Diagnostic> diagnostics_;
};

/// What crosses a port: loads on nodes, or signals, when it has no nodes; imposed motion of nodes;
/// or the amplitudes of a modal joint.
enum class PortKind { loads_or_signals, motion, modal };

/// A consistent system of units by names: "mm", "t", "s". One of `mass` and `force` is empty.
struct Units {
  std::string length, mass, force, time;
};

/// A place where peers attach: points on structural nodes, or variables out and inputs in.
struct Port {
  std::string name;
  std::vector<int> nodes = {};       ///< labels of structural nodes; empty: a signal port
  std::vector<double> offsets = {};  ///< from the nodes, in their frames [m] (3 × nodes), or empty
  std::vector<std::string> outputs = {};  ///< variables sent to the peer
  std::vector<std::string> inputs = {};   ///< inputs that the peer gives
  PortKind kind = PortKind::loads_or_signals;
  int modal_joint = 0;          ///< label, of a modal port
  bool positions_only = false;  ///< of a motion port: orientations stay free
};

/// Lets somebody else use a simulation: "token:NAME", "cert:…" or "*" for all.
struct Grant {
  enum Right { observe, couple, control };
  std::string identity;
  Right right = observe;
  std::vector<std::string> ports = {};  ///< to which `couple` is allowed; empty: all
};

enum class NonConvergence { fail, cut_step, accept_flagged };
using Symbol = std::variant<double, bool, std::string>;

/// Which result files the server writes; of no format: those that the deck asks for.
struct ResultOptions {
  enum Format { text, netcdf };
  std::vector<Format> formats = {};
  std::optional<std::int64_t> quota = {};  ///< most bytes; none: the server's limit
};

/// Whether a simulation outlives its server: from its last checkpoint on, or with all that anybody
/// was told.
enum class Durability { server_default, none, checkpoint, journal };

struct LoadOptions {
  std::string display_name = {};
  std::vector<Port> ports = {};
  NonConvergence policy = NonConvergence::fail;
  std::optional<double> minimum_step = {};  ///< of `cut_step` [s]; none: 1/1024 of the deck's
  std::optional<double> lease =
      {};                    ///< lives so long without calls [s]; none: the server's default
  bool record = false;       ///< keeps what crosses the ports; see Simulation::record
  bool summed_time = false;  ///< time is summed from step to step as MBDyn does
  std::map<std::string, Symbol> symbols = {};  ///< in place of what the deck declares
  std::vector<Grant> grants = {};              ///< who else may use it
  double timeout = kEndless;                   ///< of the call [s]
  std::optional<ResultOptions> results = {};   ///< none: no files are written
  Durability durability = Durability::server_default;
  std::optional<double> checkpoint_interval = {};     ///< wall time [s]; none: the server's
  std::optional<std::int64_t> checkpoint_steps = {};  ///< none: by time alone
  /// Serves the sockets that the deck names, and waits at most so long for each code [s].
  std::optional<double> deck_sockets = {};
  /// Their codes pad labels of an odd number of points as MBDyn does.
  bool padded_labels = false;
  std::optional<double> pace = {};  ///< seconds of the model in one of the clock; none: all speed
  std::optional<Units> units = {};  ///< that the deck is written in; none: as its card `units` says
  bool optional_ports = false;      ///< steps wait for no peer of a port that has had none
};

/// `unknown`: the server tells one that this library does not know; never a success.
enum class Outcome {
  accepted,
  finished,
  not_converged,
  interrupted,
  peer_lost,
  limit,
  not_written,  ///< accepted, but its results could not be written
  rejected_by_peer,
  unknown
};

/// What an advance did. A failure is no exception: the simulation stands at its last accepted step.
struct StepResult {
  Outcome outcome = Outcome::accepted;
  std::int64_t steps_done = 0;
  std::int64_t step = 0;  ///< number of the last accepted step
  double time = 0;        ///< its time [s]
  int iterations = 0;     ///< linear solutions of the last step
  double solver_seconds = 0, peer_wait_seconds = 0;
  double step_size = 0;            ///< of the last step [s]
  double next_step_size = 0;       ///< that the deck would take [s]
  double largest_step_size = 0;    ///< left until the deck's final time [s]
  double preferred_step_size = 0;  ///< of the peer that rejected the step [s]; 0: it did not say
  bool condition_met = false;      ///< `StepOptions::until` holds
  bool flagged = false;            ///< accepted without convergence
  int pieces = 1;                  ///< in which the last step was solved
  std::map<std::string, std::vector<double>> values = {};  ///< of `StepOptions::outputs`
  std::string failure;                                     ///< empty unless the step failed
  bool ok() const { return outcome == Outcome::accepted || outcome == Outcome::finished; }
};

/// A comparison of one number of a variable with a threshold, in the variable's unit.
struct Condition {
  enum Kind { less, less_or_equal, greater, greater_or_equal };
  std::string variable;
  Kind kind = greater_or_equal;
  double threshold = 0;
  int element = 0;
  /// The step in which it turns true is shortened until it ends at most so long after that [s]; 0:
  /// it is found at the end of a step.
  double locate_within = 0;
};

struct StepOptions {
  std::optional<double> step_size = {};  ///< of each step [s]; none: the deck's
  bool exact = false;  ///< of `run_until`: the last step is shortened, so that it ends there
  std::optional<Condition> until = {};  ///< ends after the first step for which it holds
  std::map<std::string, std::vector<double>> inputs = {};  ///< set before the first step
  std::vector<std::string> outputs = {};                   ///< variables that the result holds
  double timeout = kEndless;                               ///< of the call [s]
};

struct SimulateOptions {
  std::int64_t every = 1;  ///< a row each so many steps, and one for the last step
  bool start = true;       ///< a row for the state at the beginning
  StepOptions step = {};
};

/// Values over time: a row for each step.
struct Table {
  struct Column {
    std::string name, unit;
    int size = 1;   ///< numbers in a row
    int first = 0;  ///< of them, in the row
  };
  std::vector<Column> columns;
  int width = 0;                    ///< numbers in a row
  std::vector<std::int64_t> steps;  ///< number of the step of each row
  std::vector<double> times;        ///< [s] of each row
  std::vector<double> values;       ///< (rows × width), by rows
  StepResult result;                ///< how the run ended
  const double* row(std::size_t i) const {
    return values.data() + i * static_cast<std::size_t>(width);
  }
};

/// What a peer gets: n points, global frame unless agreed otherwise; in the deck's units, which are
/// written here as SI, unless `PeerOptions::units` are given.
struct Motion {
  std::int64_t step = 0;
  double time = 0;                ///< of the values [s]
  double target_time = 0;         ///< for which an answer is wanted [s]
  bool target_estimated = false;  ///< the step may turn out to have another length
  int iteration = 0;              ///< of a tight step, or pass of a window, from 1; 0: explicit
  std::vector<double> x;          ///< positions [m] (3n)
  std::vector<double> R;  ///< orientations, node frame to the port's: by rows (9n) unless agreed
                          ///< otherwise
  std::vector<double> v;  ///< velocities [m/s] (3n)
  std::vector<double> w;  ///< angular velocities [rad/s] (3n)
  std::vector<double> a, wp;    ///< accelerations [m/s², rad/s²] (3n) when agreed, else empty
  std::vector<double> signals;  ///< of a signal port; of a modal one: amplitudes, then their rates
  std::vector<double> forces, moments;  ///< of a motion port: reactions [N], [N·m] (3n)
  /// Of the port's reference node itself, always in the global frame; empty: it has none.
  struct Reference {
    std::vector<double> x;      ///< position [m] (3)
    std::vector<double> R;      ///< orientation in the form agreed (9, 4 or 3)
    std::vector<double> v;      ///< velocity [m/s] (3)
    std::vector<double> w;      ///< angular velocity [rad/s] (3)
    std::vector<double> a, wp;  ///< accelerations [m/s², rad/s²] (3) when agreed, else empty
  } reference;
};

/// What a peer answers.
struct Loads {
  std::vector<double> forces = {};   ///< [N] (3n)
  std::vector<double> moments = {};  ///< about the points [N·m] (3n); empty: zero
  std::vector<double> signals = {};  ///< of a signal or modal port
  /// Of a motion port: imposed at `target_time` [m] (3n), and orientations in the form agreed.
  std::vector<double> positions = {}, rotations = {};
  /// Derivatives of forces and moments with respect to positions and rotations, and to velocities
  /// and angular velocities, as `PeerOptions::tangent` announced: (6n)² or 36n, by rows.
  std::vector<double> stiffness = {}, damping = {};
  bool unfinished = false;  ///< an implicit step must not end with this answer
  /// On the reference node [N], [N·m] (3 each), for ports of a deck that want them.
  std::vector<double> reference_force = {}, reference_moment = {};
};

/// Thrown by the function of a coupled peer: the step must not be done.
struct Reject {
  double preferred_step_size = 0;  ///< that the peer would take [s]; 0: unknown
  std::string text = {};
};

enum class Mode { port_default, loose, staggered, tight, window };
enum class Policy { fail_step, hold_last, zero, wait };
enum class Acceleration { none, constant, aitken, iqn_ils };
enum class Rotation { matrix, vector, quaternion, euler_123 };
enum class Frame { port_default, global, node, reference };
enum class Tangent { none, block_diagonal, dense };
enum class Hold { zero_order, linear, quadratic };
/// What carries the exchanges: the stream of the server's protocol, or shared memory, for peers on
/// the host of a server at "unix:PATH" that need a few microseconds an exchange. The results are
/// the same, bit for bit.
enum class Transport { stream, shared_memory };

/// Called when an implicit step has ended: accepted, or to be redone from the state at that step
/// and time [s].
using StepEnded = std::function<void(bool accepted, std::int64_t step, double time)>;

struct PeerOptions {
  Mode mode = Mode::port_default;
  std::optional<int> every = {};  ///< steps between exchanges, tight: iterations; none: the port's
  double peer_timeout = 10;       ///< longest wait of the server for an answer [s]
  double timeout = kUsual;        ///< of the call that attaches [s]
  Policy policy = Policy::fail_step;
  Acceleration acceleration = Acceleration::none;
  double relaxation = 0.5;
  double tolerance = 1e-6;  ///< of the interface, relative
  int maximum_passes = 50;
  Rotation rotation = Rotation::matrix;
  Frame frame = Frame::port_default;
  bool accelerations = false;
  /// Loads turn with the node or reference node in whose frame they are, until the next answer.
  bool following_loads = false;
  bool global_reference_loads = false;  ///< those on the reference node are not in `frame`
  Hold hold = Hold::zero_order;         ///< of inputs between exchanges
  Tangent tangent = Tangent::none;      ///< tight: the answers carry derivatives
  /// The library sends a sign of life three times in so long [s], also while the peer computes;
  /// when none comes the server takes the peer for dead. 0: no such promise.
  double heartbeat_timeout = 0;
  /// The same promise of the server: when it is silent for so long [s] while the peer waits for it,
  /// the peer ends. 0: the peer waits for as long as the connection stands; over shared memory,
  /// which has no other sign of it, 20 s.
  double server_timeout = 0;
  Transport transport = Transport::stream;
  /// The peer's units: the server converts all that crosses the port, times and derivatives too.
  /// The deck's must be declared. None: the deck's.
  std::optional<Units> units = {};
  /// Of a peer that comes back: the step at whose end it stands (`Peer::step`). A simulation that
  /// stands at an earlier one refuses it (PEER_AHEAD), unless it can go back.
  std::optional<std::int64_t> step = {};
  /// The peer takes the state that it had at step `Peer::step` before it answers.
  bool can_go_back = false;
  /// Called by the thread that reads: `next`, or the peer's own, which ends with Peer::error when
  /// this throws.
  StepEnded step_ended = {};
};

/// What crosses a port, as the server said at the handshake.
struct PortLayout {
  std::string name;
  bool modal = false;
  bool motion = false;                ///< it takes imposed motion
  std::vector<int> node_labels;       ///< of the points, or the modal node
  std::optional<int> reference_node;  ///< label; none: the port has none
  bool reference_loads = false;       ///< the answer has the total load on the reference node
  std::optional<int> mapped_points;   ///< that the peer sees; none: those of the nodes
  std::vector<std::string> outputs, inputs;            ///< variables of a signal or modal port
  std::vector<int> mode_numbers;                       ///< of a modal port
  std::vector<std::string> output_units, input_units;  ///< of `outputs` and `inputs`
  std::optional<Units> units;     ///< of all that crosses; none: the deck's, not declared
  std::vector<int> point_labels;  ///< those of the nodes unless the deck says otherwise
};

/// An attached peer. Ends when it is destroyed.
class Peer {
 public:
  struct Impl;  // of the library

  Peer(Peer&&) noexcept;
  Peer& operator=(Peer&&) noexcept;
  ~Peer();
  /// Synchronous use: waits for the next exchange; false: the stream has ended, see `error`. Answer
  /// each with `answer` or `fail`.
  bool next(Motion& motion);
  /// What ended the stream; none: it stands, or it ended in good order.
  std::optional<Error> error() const;
  void answer(const Loads& loads);
  /// The peer cannot compute; the step fails with this text.
  void fail(const std::string& why);
  /// The step must not be done; it ends with Outcome::rejected_by_peer.
  void reject(const Reject& rejection);
  std::int64_t exchanges() const;
  /// Number of the step at whose end the peer stands: of the last exchange that it answered, in
  /// implicit modes of the last step that was accepted; before that where it attached. To be told
  /// when it attaches again.
  std::int64_t step() const;
  const PortLayout& layout() const;
  /// Ends a `next` that waits, from any thread; the peer can only be closed then.
  void interrupt();
  void close();

 private:
  friend class Simulation;
  explicit Peer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

using Answer = std::function<Loads(const Motion&)>;

/// A variable of the model.
struct Variable {
  enum Causality { input, output, parameter, state, unknown };  ///< unknown: of a newer server
  std::string name, unit, frame, description;
  std::string si_unit;     ///< that it has in a deck written in SI units
  std::vector<int> shape;  ///< empty: a number
  int handle = 0, size = 1;
  Causality causality = output;
};

/// Where a simulation stands.
struct SimulationInfo {
  enum State { unknown, ready, stepping, finished, failed, suspended };
  std::string name, display_name, owner, model_digest, last_failure, waiting_for;
  State state = unknown;
  std::int64_t step = 0;
  double time = 0, next_step_size = 0, final_time = 0;  ///< [s]
  std::optional<Units> units;  ///< that the deck is written in; none: not declared
};

/// A saved state.
struct Snapshot {
  std::string name, display_name;
  std::int64_t step = 0, size_bytes = 0;
  double time = 0;  ///< [s]
};

/// A matrix by rows, or what is not zero of it when `sparse`.
struct Matrix {
  int rows = 0, columns = 0;
  bool sparse = false;
  std::vector<double> values;
  std::vector<int> row_indices, column_indices;  ///< of the values, when sparse; from 0
};

/// ẋ = A x + B u, y = C x + D u; of the descriptor form E ẋ on the left, sparse, and E is not
/// empty.
struct LinearModel {
  Matrix A, B, C, D, E;
  std::vector<std::string> state_names;
  std::int64_t step = 0;
};

struct Spectrum {
  std::vector<std::complex<double>> values;   ///< [1/s]
  std::vector<std::complex<double>> vectors;  ///< by columns, one for each value; when asked for
};

enum class Overflow { drop_oldest, block, decimate };

struct SubscriptionOptions {
  std::int64_t every = 1;                       ///< steps between samples
  std::optional<double> minimum_interval = {};  ///< wall time between samples, at least [s]
  Overflow policy = Overflow::drop_oldest;
  int buffer = 1024;        ///< samples kept for a slow reader
  double timeout = kUsual;  ///< of the call [s]
};

struct Sample {
  std::int64_t step = 0, sequence = 0;
  double time = 0;             ///< [s]
  std::vector<double> values;  ///< one variable after the other
};

/// Samples of variables, whoever advances. Ends when it is destroyed. One thread reads.
class Subscription {
 public:
  struct Impl;  // of the library

  Subscription(Subscription&&) noexcept;
  Subscription& operator=(Subscription&&) noexcept;
  ~Subscription();
  /// Waits for the next sample; false: the simulation is gone or `close` was called. Throws Error.
  bool next(Sample& sample);
  std::int64_t dropped() const;  ///< samples that were not read in time
  void close();                  ///< from any thread

 private:
  friend class Simulation;
  explicit Subscription(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Steps on an open stream: one message each way per step. After an Error it is over. One thread at
/// a time; of several that share a stream, each may have its own.
class Stepper {
 public:
  struct Impl;  // of the library

  Stepper(Stepper&&) noexcept;
  Stepper& operator=(Stepper&&) noexcept;
  ~Stepper();
  /// `inputs`: numbers of the stepper's inputs, one variable after the other. `values`, `failure`
  /// and `condition_met` of the result are told as by Simulation::step. `timeout` [s].
  StepResult step(const std::vector<double>& inputs = {}, std::int64_t count = 1,
                  std::optional<double> step_size = {}, double timeout = kEndless);
  void close();

 private:
  friend class Simulation;
  explicit Stepper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

struct UpdateOptions {
  std::optional<std::string> display_name = {};
  std::optional<NonConvergence> policy = {};
  std::optional<double> minimum_step = {};        ///< [s]
  std::optional<std::vector<Grant>> grants = {};  ///< in place of those before
  double timeout = kUsual;                        ///< of the call [s]
};

/// A simulation on the server. Deletes it when destroyed, if it was loaded here and the server can
/// be reached within 2 s; its lease ends it otherwise. Calls throw Error; one thread at a time.
class Simulation {
 public:
  struct Impl;  // of the library

  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;
  ~Simulation();
  const std::string& name() const;  ///< "simulations/4f3a…"
  /// Without a timeout, steps that follow each other within 50 ms travel on an open stream of the
  /// connection, which is closed after a second without.
  StepResult step(std::int64_t count = 1, const StepOptions& options = {});
  StepResult run_until(double time, const StepOptions& options = {});
  /// Steps until `time` [s] and returns the values of variables on the way, in one call.
  Table simulate(double time, const std::vector<std::string>& outputs,
                 const SimulateOptions& options = {});
  std::vector<double> read(const std::string& variable, double timeout = kUsual) const;
  void write(const std::string& variable, const std::vector<double>& values,
             double timeout = kUsual);
  /// Stops whatever advances the simulation, from any client; was anything?
  bool interrupt(double timeout = kUsual);
  /// An open stream for stepping with the least delay.
  Stepper stepper(const std::vector<std::string>& outputs = {},
                  const std::vector<std::string>& inputs = {}, double timeout = kUsual);
  /// The same on the stream of another stepper: many simulations that are stepped in turn take
  /// less time, and fewer streams. Steps on a stream follow each other; a stepper that ends with an
  /// Error leaves the others another stream. Both are of one Server and, behind a proxy, of one
  /// daemon.
  Stepper stepper(const Stepper& beside, const std::vector<std::string>& outputs = {},
                  const std::vector<std::string>& inputs = {}, double timeout = kUsual);
  Subscription subscribe(const std::vector<std::string>& variables,
                         const SubscriptionOptions& options = {});

  SimulationInfo refresh(double timeout = kUsual);
  SimulationInfo update(const UpdateOptions& options);
  std::vector<Variable> variables(double timeout = kUsual) const;  ///< all of them
  std::vector<PortLayout> ports(double timeout = kUsual) const;
  const std::vector<Diagnostic>& diagnostics() const;  ///< of its deck: warnings, notes

  Snapshot snapshot(const std::string& display_name = {}, double timeout = kUsual);
  std::vector<Snapshot> snapshots(double timeout = kUsual) const;
  void restore(const Snapshot& snapshot, double timeout = kUsual);
  void delete_snapshot(const Snapshot& snapshot, double timeout = kUsual);
  void reset(double timeout = kEndless);  ///< to the initial solution
  /// The state as bytes: of a snapshot, or as it is now.
  std::string export_state(double timeout = kUsual) const;
  std::string export_state(const Snapshot& snapshot, double timeout = kUsual) const;
  /// All of a durable simulation, its deck included, for Server::import_checkpoint.
  std::string export_checkpoint(double timeout = kEndless) const;
  Snapshot import_state(const std::string& bytes, bool restore = true,
                        const std::string& display_name = {}, double timeout = kEndless);
  /// A new simulation at the present state, or at that of a snapshot; only ports, lease, policy and
  /// names of the options count.
  Simulation fork(const LoadOptions& options = {}) const;
  Simulation fork(const Snapshot& snapshot, const LoadOptions& options = {}) const;

  LinearModel linearize(const std::vector<std::string>& inputs = {},
                        const std::vector<std::string>& outputs = {},
                        double timeout = kEndless) const;
  LinearModel linearize_descriptor(const std::vector<std::string>& inputs = {},
                                   const std::vector<std::string>& outputs = {},
                                   double timeout = kEndless) const;
  /// `count` eigenvalues nearest to `shift`; none: all finite ones.
  Spectrum eigenvalues(std::optional<int> count = {}, double shift = 0, bool vectors = false,
                       double timeout = kEndless) const;
  /// What can be drawn.
  Geometry geometry(const GeometryOptions& options = {}, double timeout = kEndless) const;
  /// Sizes of the result files so far [bytes], by name; see LoadOptions::results.
  std::map<std::string, std::int64_t> result_files(double timeout = kUsual) const;
  /// Bytes of a result file: all from `offset` on, or at most `length`.
  std::string result_file(const std::string& file, std::int64_t offset = 0,
                          std::optional<std::int64_t> length = {}, double timeout = kEndless) const;
  /// All that crossed the ports so far, for `mbcosim replay`.
  std::string record(double timeout = kEndless) const;
  /// Attaches a peer that asks for exchanges itself: `Peer::next`. It needs a thread other than the
  /// one that steps.
  Peer attach(const std::string& port, const PeerOptions& options = {});
  /// Attaches a peer whose own thread calls `answer` at each exchange; an exception in it fails the
  /// step, a Reject rejects it.
  Peer couple(const std::string& port, Answer answer, const PeerOptions& options = {});

 private:
  friend class Server;
  explicit Simulation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Who the client is, and how it knows the server. Texts of PEM files, not their names.
struct Credentials {
  std::string token = {};      ///< bearer token
  bool tls = false;            ///< TLS; the connection uses it with one of the next, too
  std::string server_ca = {};  ///< of the server's certificate; empty: who this machine trusts
  std::string certificate = {}, key = {};  ///< of the client, for servers that want one
};

/// A connection.
class Server {
 public:
  struct Impl;  // of the library

  /// "unix:PATH" or "HOST:PORT"; waits until the server answers, at most `timeout` seconds. For
  /// `reconnect` seconds calls are made again when the server cannot be reached, and is perhaps
  /// about to come back with its simulations; timeouts grow by as much. Each is done once all the
  /// same. Streams (steppers, subscriptions, peers, `simulate`, exports) end.
  static Server connect(const std::string& address, double timeout = 10,
                        const Credentials& credentials = {}, double reconnect = 0);
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  ~Server();
  std::string version(double timeout = kUsual) const;
  std::vector<SimulationInfo> list(double timeout = kUsual) const;  ///< that the caller may see
  /// A deck of this machine, with the files that it names in quotes.
  Simulation load(const std::string& path, const LoadOptions& options = {});
  Simulation load_text(const std::string& deck, const LoadOptions& options = {});
  /// Files by name, of which `main` is read.
  Simulation load_bundle(const std::string& main, const std::map<std::string, std::string>& files,
                         const LoadOptions& options = {});
  /// A deck under the server's model root.
  Simulation load_from_root(const std::string& deck, const LoadOptions& options = {});
  /// What there is to say about a deck of this machine; empty: nothing.
  std::vector<Diagnostic> validate(const std::string& path, double timeout = kEndless);
  /// A simulation that another client loaded, by its name; it lives on afterwards.
  Simulation find(const std::string& name, double timeout = kUsual);
  /// A new simulation from what `export_checkpoint` gave, here or on another server; it lives on
  /// afterwards.
  Simulation import_checkpoint(const std::string& bytes, const std::string& display_name = {},
                               double timeout = kEndless);
  /// Events from now on, of one simulation (by name) or of all that the caller may see; with the
  /// place where a watcher has ended also what came since.
  Events events(const std::string& simulation = {}, const EventPlace& after = {},
                double timeout = kUsual);

 private:
  explicit Server(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace mbcosim::client
