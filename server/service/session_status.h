/// What can be told of a session without waiting for its step, and who advances it.
#pragma once

#include <cstdint>
#include <string>

#include "simulation/simulation.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// Thread-safe.
class SessionStatus {
 public:
  struct View {
    std::int64_t step = 0;
    double time = 0, next_step = 0;
    bool finished = false, failed = false, stepping = false;
    std::string last_failure, display_name;
    StepPolicy policy;
    std::int64_t late_steps = 0;  ///< of a paced simulation
    double worst_delay = 0;       ///< [s]
  };
  View view() const {
    const Guard guard(mutex_);
    return view_;
  }
  void publish(const Simulation& simulation);
  /// What `view` will give when the simulation, restored, is published and nobody advances it.
  View recovered(const Simulation& simulation) const;
  void set_display_name(const std::string& name);
  void set_policy(const StepPolicy& policy);
  void count_late_step(double delay);
  void remember_failure(const std::string& why);
  void fail(const std::string& why);  ///< the server failed in it
  void recover();                     ///< it was restored
  bool failed() const;
  StepPolicy policy() const {
    const Guard guard(mutex_);
    return view_.policy;
  }

  // --- one call at a time advances
  bool stepping() const;
  /// False: another call advances. Until `release`, `token` is cancelled by `interrupt`; null: what
  /// is done cannot be interrupted.
  bool claim(CancelToken* token);
  void release();
  /// Was anything advancing?
  bool interrupt();

 private:
  mutable Mutex mutex_;
  View view_ TS_GUARDED_BY(mutex_);
  CancelToken* running_ TS_GUARDED_BY(mutex_) = nullptr;
};

}  // namespace mbcosim::server
