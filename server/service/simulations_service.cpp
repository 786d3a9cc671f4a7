#include "service/simulations_service.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <utility>

#include "service/durability.h"
#include "service/protocol.h"

namespace mbcosim::server {
namespace {

using google::protobuf::util::TimeUtil;

void add_limit(v1::GetServerInfoReply* info, const char* name, std::int64_t maximum) {
  v1::Limit* limit = info->add_limits();
  limit->set_name(name);
  if (maximum != 0) limit->set_maximum(maximum);
}

void add_limits(const ServiceLimits& limits, v1::GetServerInfoReply* reply) {
  add_limit(reply, "sessions", limits.sessions);
  add_limit(reply, "identity_sessions", limits.identity_sessions);
  add_limit(reply, "memory_bytes", limits.memory_bytes);
  add_limit(reply, "identity_memory_bytes", limits.identity_memory_bytes);
  add_limit(reply, "open_calls", limits.open_calls);
  add_limit(reply, "identity_calls", limits.identity_calls);
  add_limit(reply, "identity_streams", limits.identity_streams);
  add_limit(reply, "connection_calls", limits.connection_calls);
  add_limit(reply, "shared_memory_peers", limits.shared_memory_peers);
  add_limit(reply, "http_connections", limits.http_connections);
  add_limit(reply, "http_streams", limits.http_streams);
  add_limit(reply, "deck_sockets", limits.deck_sockets);
  add_limit(reply, "snapshots", limits.snapshots);
  add_limit(reply, "snapshot_bytes", limits.snapshot_bytes);
  add_limit(reply, "message_bytes", limits.message_bytes);
  add_limit(reply, "bundle_files", limits.bundle_files);
  add_limit(reply, "record_bytes", limits.record_bytes);
  add_limit(reply, "state_bytes", limits.state_bytes);
  add_limit(reply, "results_bytes", limits.results_bytes);
  add_limit(reply, "results_root_bytes", limits.results_root_bytes);
  add_limit(reply, "telemetry_samples", limits.telemetry_samples);
  add_limit(reply, "lease_seconds", limits.lease.count());
  add_limit(reply, "deck_bytes", limits.engine.deck_bytes);
  add_limit(reply, "include_depth", limits.engine.include_depth);
  add_limit(reply, "include_count", limits.engine.include_count);
  add_limit(reply, "statements", limits.engine.statements);
  add_limit(reply, "loop_iterations", limits.engine.loop_iterations);
  add_limit(reply, "expression_depth", limits.engine.expression_depth);
  add_limit(reply, "nesting_depth", limits.engine.nesting_depth);
  add_limit(reply, "unknowns", limits.engine.unknowns);
}

void fill_info(const Config& config, const Caller& caller, v1::GetServerInfoReply* reply) {
  reply->set_version(MBCOSIM_VERSION);
  fill_protocol(reply->mutable_protocol());
  add_limits(config.limits, reply);
  reply->set_identity(caller.identity);
  reply->set_role(role_name(caller.role));
}

/// One line of the list: alive, or on the disk.
struct Entry {
  std::pair<std::int64_t, std::string> place;  ///< when it was created, its name
  SessionPtr session;
  v1::SimulationInfo suspended;
};

std::vector<Entry> entries_for(const Parts& parts, const Caller& caller) {
  std::vector<Entry> entries;
  std::set<std::string> names;
  for (SessionPtr& session : parts.store.list(caller)) {
    names.insert(session->identity().id);
    const Session::Identity& identity = session->identity();
    entries.push_back({{identity.created, identity.id}, std::move(session), {}});
  }
  for (v1::SimulationInfo& info : parts.durability.list(caller))
    if (names.count(info.name()) == 0) {
      const std::int64_t created = TimeUtil::TimestampToMicroseconds(info.create_time());
      entries.push_back({{created, info.name()}, nullptr, std::move(info)});
    }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.place < b.place; });
  return entries;
}

/// Names the first entry of a page: "INSTANT.NAME". Throws BAD_ARGUMENT.
std::pair<std::int64_t, std::string> place_of(const std::string& token) {
  std::pair<std::int64_t, std::string> place;
  const char* const end = token.data() + token.size();
  const auto [dot, error] = std::from_chars(token.data(), end, place.first);
  if (error != std::errc() || dot == end || *dot != '.')
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`page_token` is not one of the server's");
  place.second.assign(dot + 1, end);
  return place;
}

void list(const Parts& parts, const Caller& caller, const v1::ListSimulationsRequest& request,
          v1::ListSimulationsReply* reply) {
  std::vector<Entry> entries = entries_for(parts, caller);
  const auto page = static_cast<std::size_t>(page_size_of(request, /*usual=*/100, /*most=*/1000));
  auto next = entries.begin();
  if (!request.page_token().empty())
    next =
        std::lower_bound(entries.begin(), entries.end(), place_of(request.page_token()),
                         [](const Entry& entry, const auto& place) { return entry.place < place; });
  for (; next != entries.end(); ++next) {
    if (static_cast<std::size_t>(reply->simulations_size()) == page) {
      reply->set_next_page_token(std::to_string(next->place.first) + "." + next->place.second);
      return;
    }
    if (next->session)
      next->session->fill(reply->add_simulations(), caller);
    else
      *reply->add_simulations() = std::move(next->suspended);
  }
}

/// Whoever waits for the simulation is told at once, even where all threads that may wait do so;
/// its files may have to wait themselves.
class DeleteHandler final : public OneRequest<v1::DeleteSimulationRequest> {
 public:
  explicit DeleteHandler(const Parts& parts) : OneRequest(Lane::quick), parts_(parts) {}

 private:
  void serve(Exchange& exchange, const v1::DeleteSimulationRequest& request) override {
    removal_ =
        parts_.store.begin_removal(request.simulation(), exchange.caller(), request.request_id());
    exchange.post(Lane::work, [this, &exchange, &request] {
      CallLabels labels = exchange.labels();
      labels.request_id = request.request_id();
      const CallScope scope(labels);
      parts_.store.end_removal(std::move(removal_), request.simulation(), exchange.caller(),
                               exchange.call(), request.request_id());
      exchange.end(serialized(v1::DeleteSimulationReply()));
    });
  }

  const Parts& parts_;
  SessionStore::Removal removal_;
};

void add_life(Gate& gate, const Parts& parts) {
  gate.add(simulations_path("GetServerInfo"),
           unary<v1::GetServerInfoRequest, v1::GetServerInfoReply>(
               Role::observe, Lane::quick,
               [&parts](const CallFrame& frame, const auto&, v1::GetServerInfoReply* reply) {
                 fill_info(parts.config, frame.caller, reply);
               }));
  gate.add(simulations_path("ListSimulations"),
           unary<v1::ListSimulationsRequest, v1::ListSimulationsReply>(
               Role::observe, Lane::quick,
               [&parts](const CallFrame& frame, const auto& request, auto* reply) {
                 list(parts, frame.caller, request, reply);
               }));
  gate.add(simulations_path("DeleteSimulation"), {Role::control, false, Counted::call, [&parts] {
                                                    return std::make_unique<DeleteHandler>(parts);
                                                  }});
  gate.add(simulations_path("GetSimulation"),
           unary<v1::GetSimulationRequest, v1::GetSimulationReply>(
               Role::observe, Lane::quick,
               [&parts](const CallFrame& frame, const auto& request, auto* reply) {
                 const std::string& name = request.simulation();
                 if (!parts.store.has(name) &&
                     parts.durability.describe(name, frame.caller, reply->mutable_simulation()))
                   return;
                 const SessionHold session(parts.store, name, frame.caller, frame.call,
                                           Access::see);
                 session->fill(reply->mutable_simulation(), frame.caller);
               }));
  gate.add(
      simulations_path("UpdateSimulation"),
      on_session<v1::UpdateSimulationRequest, v1::UpdateSimulationReply>(
          parts, Role::control, Lane::work,
          [&parts](Session& session, const v1::UpdateSimulationRequest& request,
                   v1::UpdateSimulationReply* reply, const Session::Change& change) {
            if (session.grants().allow(change.caller, Access::own))  // else it is refused anyway
              Grants::check_known(request.grants().grants(), parts.runtime.authenticator);
            session.update(request, change, reply);
          }));
  gate.add(
      simulations_path("DescribeSimulation"),
      on_session<v1::DescribeSimulationRequest, v1::DescribeSimulationReply>(
          parts, Role::observe, Lane::work, [](Session& session, const auto& request, auto* reply) {
            session.describe(request, reply);
          }));
}

void add_variables(Gate& gate, const Parts& parts) {
  gate.add(simulations_path("ReadVariables"),
           on_session<v1::ReadVariablesRequest, v1::ReadVariablesReply>(
               parts, Role::observe, Lane::work,
               [](Session& session, const auto& request, auto* reply, const CallFrame& frame) {
                 frame.share.grow(session.variable_access().bytes_of(request.handles()));
                 session.read(request, frame.call, reply);
               },
               std::nullopt,
               [](Session& session, const v1::ReadVariablesRequest& request,
                  v1::ReadVariablesReply* reply, const CallFrame& frame) {
                 const MemoryShare values(frame.memory,
                                          session.variable_access().bytes_of(request.handles()));
                 return session.read_at_once(request, reply);
               }));
  gate.add(simulations_path("WriteVariables"),
           on_session<v1::WriteVariablesRequest, v1::WriteVariablesReply>(
               parts, Role::control, Lane::work,
               [](Session& session, const v1::WriteVariablesRequest& request,
                  v1::WriteVariablesReply* reply, const Session::Change& change) {
                 session.write(request, change.call, change.turn, reply);
               }));
}

void add_analysis(Gate& gate, const Parts& parts) {
  gate.add(simulations_path("Linearize"),
           on_session<v1::LinearizeRequest, v1::LinearizeReply>(
               parts, Role::control, Lane::heavy,
               [](Session& session, const auto& request, auto* reply, const CallFrame& frame) {
                 session.linearize(request, frame.call, reply);
               }));
  gate.add(simulations_path("ComputeEigenvalues"),
           on_session<v1::ComputeEigenvaluesRequest, v1::ComputeEigenvaluesReply>(
               parts, Role::control, Lane::heavy,
               [](Session& session, const auto& request, auto* reply, const CallFrame& frame) {
                 session.eigenvalues(request, frame.call, reply);
               }));
}

}  // namespace

void add_simulations(Gate& gate, const Parts& parts) {
  add_life(gate, parts);
  add_creation(gate, parts);
  add_stepping(gate, parts);
  add_variables(gate, parts);
  add_snapshots(gate, parts);
  add_checkpoints(gate, parts);
  add_analysis(gate, parts);
}

}  // namespace mbcosim::server
