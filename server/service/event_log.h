/// What happens to simulations, for operators (a line in the log, and no flood of them) and for
/// those who watch (an event).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "service/event_journal.h"
#include "service/grants.h"
#include "threads/mutex.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// Lets so many pass in a second, and counts what it held back. Thread-safe.
class Rate {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Rate(int per_second) : per_second_(per_second) {}
  /// False: this one is held back. `missed`: those held back before it.
  bool pass(Clock::time_point now, std::int64_t* missed) TS_EXCLUDES(mutex_);

 private:
  const int per_second_;
  Mutex mutex_;
  Clock::time_point second_ TS_GUARDED_BY(mutex_){};
  int passed_ TS_GUARDED_BY(mutex_) = 0;
  std::int64_t missed_ TS_GUARDED_BY(mutex_) = 0;
};

/// What a line of the log is about, by name: "session", "port", "peer".
using LogFields = std::vector<std::pair<const char*, std::string>>;

/// Thread-safe. Texts of clients lose their control characters.
class EventLog {
 public:
  /// The simulation that something happens to.
  struct Subject {
    const std::string& name;
    const Grants& grants;  ///< who may know at that moment
  };
  void refused(const std::string& method, const std::string& identity, const Refusal& refusal);
  void created(const Subject& subject, const std::string& display_name,
               const std::string& forked_from);
  void deleted(const Subject& subject, v1::DeletionCause cause);
  void state_changed(const Subject& subject, v1::SimulationState state, std::int64_t step);
  void step_failed(const Subject& subject, v1::StepOutcome outcome,
                   const v1::SolverFailure& failure);
  /// `peer`: its identity; `why`: of being late.
  void peer(const Subject& subject, v1::PeerChange change, const std::string& port,
            const std::string& peer, const std::string& why = "");
  void snapshot(const Subject& subject, v1::SnapshotChange change, const std::string& name,
                std::int64_t step);
  void checkpoint(const Subject& subject, std::int64_t step, std::int64_t bytes);
  void checkpoint_failed(const Subject& subject, const std::string& why);
  void lease_ending(const Subject& subject, double seconds_left);

  EventJournal& journal() { return journal_; }
  /// Of the line that this thread writes at the moment.
  static const LogFields& fields();

 private:
  void write(Rate& rate, const std::string& text, LogFields fields);
  void add(const Subject& subject, v1::Event event);
  Rate refusals_{20}, peers_{50}, failures_{20}, lives_{50};
  EventJournal journal_;
};

/// The text with '?' in place of control characters.
std::string printable(std::string text);

}  // namespace mbcosim::server
