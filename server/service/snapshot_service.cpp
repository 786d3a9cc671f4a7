/// Methods that save, restore and carry states.
#include <memory>
#include <optional>

#include "service/simulations_service.h"

namespace mbcosim::server {
namespace {

/// A snapshot named by the client: its simulation, kept alive, and its number.
struct Named {
  Named(const Parts& parts, const std::string& name, const Caller& caller)
      : number(number_of_snapshot(name, &simulation)),
        session(parts.store, simulation, caller, Access::control) {}
  std::string simulation;
  int number;
  SessionHold session;
};

class ImportHandler final : public Upload<v1::ImportSnapshotRequest> {
 public:
  explicit ImportHandler(const Parts& parts) : parts_(parts) {}

 private:
  void add(Exchange& exchange, v1::ImportSnapshotRequest& request, MemoryShare) override {
    if (!session_) {
      if (!request.has_header())
        throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an import must be `header`");
      header_ = request.header();
      share_ = MemoryShare(exchange.memory());
      session_.emplace(parts_.store, header_.simulation(), exchange.caller(), Access::control);
      return;
    }
    if (request.has_header())
      throw Refusal(v1::REASON_OUT_OF_TURN, "after `header` an import has only `data` messages");
    const std::int64_t most = parts_.config.limits.snapshot_bytes;
    if (static_cast<std::int64_t>(bytes_.size() + request.data().size()) > most)
      throw limit_refusal("snapshot_bytes", most, "the snapshot is larger than allowed");
    share_.grow(static_cast<std::int64_t>(request.data().size()));
    bytes_ += request.data();
  }
  void complete(Exchange& exchange) override {
    if (!session_)
      throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an import must be `header`");
    v1::Snapshot reply;
    (*session_)->import_state(bytes_, header_.display_name(), header_.restore(), &reply);
    exchange.end(serialized(reply));
  }

  const Parts& parts_;
  v1::ImportSnapshotHeader header_;
  std::optional<SessionHold> session_;
  MemoryShare share_;
  std::string bytes_;
};

using ExportReplies = Series<v1::ExportSnapshotRequest, v1::ExportSnapshotReply>;

ExportReplies::Source exported(const Parts& parts, const Caller& caller,
                               const v1::ExportSnapshotRequest& request) {
  std::string simulation = request.simulation();
  const int number =
      request.has_snapshot() ? number_of_snapshot(request.snapshot(), &simulation) : -1;
  const SessionHold session(parts.store, simulation, caller, Access::observe);
  auto bytes = std::make_shared<std::string>();
  auto share = std::make_shared<MemoryShare>();
  *bytes = within(parts.runtime.budgets.of(caller.identity), nullptr, share.get(),
                  [&] { return session->export_state(number); });
  return [bytes, share, at = std::size_t{0}](auto* reply) mutable {
    if (at >= bytes->size()) return false;
    reply->set_data(bytes->substr(at, kChunkBytes));
    at += kChunkBytes;
    return true;
  };
}

using RecordReplies = Series<v1::GetRecordRequest, v1::GetRecordReply>;

RecordReplies::Source recorded(const Parts& parts, const Caller& caller,
                               const v1::GetRecordRequest& request) {
  auto session =
      std::make_shared<SessionHold>(parts.store, request.name(), caller, Access::observe);
  const Recorder& record = (*session)->record();
  return [session, &record, at = std::size_t{0}](auto* reply) mutable {
    std::string piece = record.read(at, kChunkBytes);
    at += piece.size();
    const bool some = !piece.empty();
    reply->set_data(std::move(piece));
    return some;
  };
}

void add_saved(Gate& gate, const Parts& parts) {
  gate.add(
      simulations_path("CreateSnapshot"),
      on_session<v1::CreateSnapshotRequest, v1::Snapshot>(
          parts, Role::control, Lane::work, [](Session& session, const auto& request, auto* reply) {
            session.save(request.display_name(), reply);
          }));
  gate.add(simulations_path("ListSnapshots"),
           on_session<v1::ListSnapshotsRequest, v1::ListSnapshotsReply>(
               parts, Role::observe, Lane::work, [](Session& session, const auto&, auto* reply) {
                 session.snapshots().list(reply);
               }));
  gate.add(simulations_path("RestoreSnapshot"),
           unary<v1::RestoreSnapshotRequest, v1::SimulationInfo>(
               Role::control, Lane::work,
               [&parts](const CallFrame& frame, const auto& request, auto* reply) {
                 const Named named(parts, request.name(), frame.caller);
                 named.session->restore(named.number);
                 named.session->fill(reply, frame.caller);
               }));
  gate.add(
      simulations_path("DeleteSnapshot"),
      unary<v1::DeleteSnapshotRequest, v1::DeleteSnapshotReply>(
          Role::control, Lane::work, [&parts](const CallFrame& frame, const auto& request, auto*) {
            const Named named(parts, request.name(), frame.caller);
            named.session->forget(named.number);
          }));
}

}  // namespace

void add_snapshots(Gate& gate, const Parts& parts) {
  add_saved(gate, parts);
  gate.add(simulations_path("ExportSnapshot"),
           series<v1::ExportSnapshotRequest, v1::ExportSnapshotReply>(
               Role::observe, Lane::work, [&parts](const CallFrame& frame, const auto& request) {
                 return exported(parts, frame.caller, request);
               }));
  gate.add(simulations_path("ImportSnapshot"),
           stream(Role::control, [&parts] { return std::make_unique<ImportHandler>(parts); }));
  gate.add(simulations_path("GetRecord"),
           series<v1::GetRecordRequest, v1::GetRecordReply>(
               Role::observe, Lane::work, [&parts](const CallFrame& frame, const auto& request) {
                 return recorded(parts, frame.caller, request);
               }));
}

}  // namespace mbcosim::server
