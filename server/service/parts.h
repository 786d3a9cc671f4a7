/// What all services of the daemon share.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "results/results_root.h"
#include "rpc/methods.h"
#include "service/config.h"
#include "service/event_log.h"
#include "service/session_store.h"

namespace mbcosim::server {

class Durability;

/// The parts of a daemon that handlers use. All of it outlives the services.
struct Parts {
  const Config& config;
  SessionStore& store;
  SolverSlots& slots;
  Metrics& metrics;
  EventLog& log;
  const Runtime& runtime;
  const Gate& gate;
  ResultsRoot& results;
  Durability& durability;

  /// What every session gets; `memory`: its owner's.
  Session::Shared shared(MemoryBudget& memory) const {
    return {slots, config.limits, metrics, log, memory, runtime.lanes, runtime.timer};
  }
};

template <class Request>
const std::string& simulation_in(const Request& request) {
  if constexpr (requires { request.simulation(); })
    return request.simulation();
  else
    return request.name();
}

/// A method that works on one simulation, which is found and kept alive meanwhile. The role tells
/// what the caller must be allowed to do with it, unless `other_access` does.
template <class Request, class Reply, class Body>
Method on_session(const Parts& parts, Role role, Lane lane, Body body,
                  std::optional<Access> other_access = {}) {
  const Access access =
      other_access.value_or(role == Role::observe ? Access::observe : Access::control);
  return unary<Request, Reply>(
      role, lane,
      [&parts, access, body = std::move(body)](const CallFrame& frame, const Request& request,
                                               Reply* reply) {
        const SessionHold session(parts.store, simulation_in(request), frame.caller, access);
        if constexpr (std::is_invocable_v<Body, Session&, const Request&, Reply*, const CallFrame&>)
          body(*session, request, reply, frame);
        else if constexpr (std::is_invocable_v<Body, Session&, const Request&, Reply*, Call&>)
          body(*session, request, reply, frame.call);
        else
          body(*session, request, reply);
      });
}

}  // namespace mbcosim::server
