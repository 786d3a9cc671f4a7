/// What all services of the daemon share: the parts behind them, and the frame around every
/// handler.
#pragma once

#include <grpcpp/server_context.h>
#include <spdlog/spdlog.h>

#include "service/auth.h"
#include "service/call_watch.h"
#include "service/config.h"
#include "service/session_store.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// The parts of a daemon that handlers use. All of it outlives the services.
struct Parts {
  const Config& config;
  const Authenticator& authenticator;
  SessionStore& store;
  CallWatch& watch;
  SolverSlots& slots;
  Metrics& metrics;
};

/// Runs `body(caller)` after `identify()` has told who calls; turns refusals into statuses.
/// `method` is for the log.
template <class Identify, class Body>
grpc::Status serve_caller(const Parts& parts, const char* method, Identify&& identify,
                          Body&& body) {
  try {
    if (parts.watch.closing())
      throw Refusal(v1::REASON_SHUTTING_DOWN, "the server is shutting down; try again later");
    const Caller caller = identify();
    body(caller);
    return grpc::Status::OK;
  } catch (const Refusal& refusal) {
    spdlog::info("{} refused: {}: {}", method, reason_name(refusal.reason()), refusal.what());
    parts.metrics.count_failure(refusal.reason());
    return refusal.status();
  } catch (const std::bad_alloc&) {
    spdlog::error("{}: out of memory", method);
    return limit_refusal("memory", 0, "the server is out of memory").status();
  } catch (const std::exception& error) {
    spdlog::error("{}: {}", method, error.what());
    parts.metrics.count_failure(v1::REASON_INTERNAL);
    return Refusal(v1::REASON_INTERNAL, "internal error in " + std::string(method)).status();
  }
}

/// The same for calls over gRPC.
template <class Body>
grpc::Status serve(const Parts& parts, const grpc::ServerContext& context, const char* method,
                   Role role, Body&& body) {
  return serve_caller(
      parts, method, [&] { return parts.authenticator.check(context, role); }, body);
}

}  // namespace mbcosim::server
