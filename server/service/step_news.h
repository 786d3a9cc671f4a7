/// What others than the caller learn of a session's steps.
#pragma once

#include "coupling/recorder.h"
#include "service/event_log.h"
#include "service/session_status.h"
#include "service/step_choice.h"
#include "service/telemetry_hub.h"

namespace mbcosim::server {

/// Tells the status, the log, subscribers and the record of the ports. The session's lock protects
/// it.
class StepNews {
 public:
  struct Parts {
    EventLog::Subject subject;
    EventLog& log;
    SessionStatus& status;
    TelemetryHub& telemetry;
    Recorder* recorder;  ///< null: nothing is recorded
  };
  /// All parts outlive this.
  explicit StepNews(const Parts& parts) : parts_(parts) {}

  /// Inputs were written before the first step.
  void inputs(const v1::Values& inputs);
  /// A step of the request follows.
  void chosen(const StepChoice& choice, const v1::StepRequest& request,
              const Simulation& simulation);
  /// Does anybody learn of such a step as soon as it is told?
  bool concerns(const StepReport& report) const;
  /// It was taken, or failed, as the reply says.
  void stepped(const StepReport& report, const v1::StepReply& reply, const Simulation& simulation);
  /// It was interrupted.
  void unsolved(const Simulation& simulation);
  /// It ended without being solved, for the reason that the reply has.
  void failed(const v1::StepReply& reply, const Simulation& simulation);
  /// The server failed in it: the simulation, which all know at `step`, cannot be used any more.
  /// `what`: for the log, `told`: for callers.
  void broken(const std::string& what, const std::string& told, std::int64_t step);

 private:
  const Parts parts_;
};

}  // namespace mbcosim::server
