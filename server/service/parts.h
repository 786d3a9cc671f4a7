/// What all services of the daemon share.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "results/results_root.h"
#include "rpc/methods.h"
#include "service/config.h"
#include "service/event_log.h"
#include "service/keeping.h"
#include "service/session_store.h"
#include "threads/mutex.h"

namespace mbcosim::server {

class DeckSocketFolder;
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
  DeckSocketFolder& deck_sockets;

  /// What every session gets; `memory`: its owner's.
  Session::Shared shared(MemoryBudget& memory) const {
    return {slots, config.limits, metrics, log, memory, runtime.lanes, runtime.timer};
  }
};

/// Number of a snapshot of the simulation that the request names. Throws NO_SUCH_SNAPSHOT,
/// BAD_ARGUMENT.
template <class Request>
int snapshot_in(const Request& request) {
  std::string owner;
  const int number = number_of_snapshot(request.snapshot(), &owner);
  if (owner != request.simulation())
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`snapshot` is of another simulation than `simulation` names");
  return number;
}

/// Does `work`, which fills the reply, unless this very request was done before.
template <class Request, class Reply, class Work>
void once(Session& session, const CallFrame& frame, const Request& request, Reply* reply,
          Work work) {
  if (request.request_id().empty()) return work();
  KeptReplies::Turn turn(session.kept(), frame.caller, request.request_id(),
                         digest_of(Request::descriptor()->name().c_str(), request), frame.call);
  if (turn.known()) {
    reply->ParseFromString(*turn.known());
    return;
  }
  work();
  turn.keep(*reply);
  session.note_change();
}

/// Without the state that it leads to, was the request not done? Snapshots and settings stand by
/// themselves.
template <class Request>
bool is_of_state(const Request& request) {
  if constexpr (requires { request.restore(); })
    return request.restore();
  else
    return !std::is_same_v<Request, v1::CreateSnapshotRequest> &&
           !std::is_same_v<Request, v1::DeleteSnapshotRequest> &&
           !std::is_same_v<Request, v1::UpdateSimulationRequest>;
}

/// The same for what changes a durable session: no checkpoint is taken between the change and its
/// reply.
template <class Request, class Reply, class Body>
void change_once(const SessionStore& store, Session& session, const CallFrame& frame,
                 const Request& request, Reply* reply, const Body& body) {
  const std::string& id = request.request_id();
  const std::uint64_t digest =
      id.empty() ? 0 : digest_of(Request::descriptor()->name().c_str(), request);
  KeptReplies::Turn turn(session.kept(), frame.caller, id, digest, frame.call,
                         is_of_state(request));
  if (turn.known()) {
    reply->ParseFromString(*turn.known());
    return;
  }
  const auto act = [&] {
    body(session, request, reply, Session::Change{frame.caller, frame.call, store, turn});
    turn.keep(*reply);
    session.note_change();
  };
  if (Keeping* const keeping = session.keeping()) {
    const Guard no_checkpoint(keeping->mutex);
    act();
  } else {
    act();
  }
}

/// What may be done on a poller's thread; false: not now, and nothing has been done.
template <class Request, class Reply>
using QuickBody = std::function<bool(Session&, const Request&, Reply*, const CallFrame&)>;

/// The same for a simulation that is in memory and whose steps are quick.
template <class Request, class Reply>
typename Unary<Request, Reply>::AtOnce on_quick_session(const Parts& parts, Access access,
                                                        QuickBody<Request, Reply> body) {
  if (!body) return {};
  return [&parts, access, body = std::move(body)](const CallFrame& frame, const Request& request,
                                                  Reply* reply) {
    SessionPtr alive = parts.store.get_alive(request.simulation(), frame.caller, access);
    if (!alive || !alive->is_quick() || !alive->lease().take()) return false;
    const SessionHold session(std::move(alive), std::adopt_lock);
    return body(*session, request, reply, frame);
  };
}

/// A method that works on one simulation, which is found and kept alive meanwhile; a request with
/// an id changes it, and is done once. The role tells what the caller must be allowed to do with
/// it, unless `other_access` does. `at_once` is tried first.
template <class Request, class Reply, class Body>
Method on_session(const Parts& parts, Role role, Lane lane, Body body,
                  std::optional<Access> other_access = {}, QuickBody<Request, Reply> at_once = {}) {
  const Access access =
      other_access.value_or(role == Role::observe ? Access::observe : Access::control);
  return unary<Request, Reply>(
      role, lane,
      [&parts, access, body = std::move(body)](const CallFrame& frame, const Request& request,
                                               Reply* reply) {
        const SessionHold session(parts.store, request.simulation(), frame.caller, frame.call,
                                  access);
        if constexpr (requires { request.request_id(); } &&
                      !std::is_same_v<Request, v1::StepRequest>)
          change_once(parts.store, *session, frame, request, reply, body);
        else if constexpr (std::is_invocable_v<Body, Session&, const Request&, Reply*,
                                               const CallFrame&>)
          body(*session, request, reply, frame);
        else
          body(*session, request, reply);
      },
      on_quick_session<Request, Reply>(parts, access, std::move(at_once)));
}

}  // namespace mbcosim::server
