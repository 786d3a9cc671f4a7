/// Methods that save, restore and carry states.
#include <memory>
#include <optional>
#include <string>

#include "math/hash.h"
#include "service/display_name.h"
#include "service/simulations_service.h"

namespace mbcosim::server {
namespace {

class SnapshotImport final : public Upload<v1::ImportSnapshotRequest> {
 public:
  explicit SnapshotImport(const Parts& parts) : parts_(parts) {}

 private:
  void add(Exchange& exchange, v1::ImportSnapshotRequest& request, MemoryShare share) override {
    if (!session_) {
      if (!request.has_header())
        throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an import must be `header`");
      header_ = request.header();
      check_display_name(header_.display_name());
      header_share_ = std::move(share);
      share_ = MemoryShare(exchange.memory());
      session_.emplace(parts_.store, header_.simulation(), exchange.caller(), exchange.call(),
                       Access::control);
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
    v1::ImportSnapshotReply reply;
    const auto import = [this](Session& session, const v1::ImportSnapshotHeader&,
                               v1::ImportSnapshotReply* out, const Session::Change& change) {
      session.import_state(bytes_, header_.display_name(), header_.restore(), change, *out,
                           out->mutable_snapshot());
    };
    change_once(parts_.store, **session_, frame_of(exchange, share_), question(), &reply, import);
    exchange.end(serialized(reply));
  }

  /// The import as one request: header and digest of the bytes.
  v1::ImportSnapshotHeader question() const {
    v1::ImportSnapshotHeader all = header_;
    all.set_display_name(all.display_name() + '\0' + std::to_string(fnv1a(bytes_)));
    return all;
  }

  const Parts& parts_;
  v1::ImportSnapshotHeader header_;
  std::optional<SessionHold> session_;
  MemoryShare header_share_, share_;
  std::string bytes_;
};

using SnapshotReplies = Series<v1::ExportSnapshotRequest, v1::ExportSnapshotReply>;

SnapshotReplies::Source exported_snapshot(const Parts& parts, const CallFrame& frame,
                                          const v1::ExportSnapshotRequest& request) {
  const SessionHold session(parts.store, request.simulation(), frame.caller, frame.call,
                            Access::observe);
  const int number = request.has_snapshot() ? snapshot_in(request) : -1;
  auto bytes = std::make_shared<std::string>();
  auto share = std::make_shared<MemoryShare>();
  const CallToken token(frame.call);
  *bytes = within(parts.runtime.budgets.of(frame.caller.identity), &token, share.get(),
                  [&] { return session->export_state(number, frame.call); });
  return [bytes, share, at = std::size_t{0}](auto* reply) mutable {
    reply->set_data(bytes->substr(at, kChunkBytes));
    at += kChunkBytes;
    return at < bytes->size() ? Next::message : Next::last;
  };
}

using RecordReplies = Series<v1::GetRecordRequest, v1::GetRecordReply>;

RecordReplies::Source recorded(const Parts& parts, const CallFrame& frame,
                               const v1::GetRecordRequest& request) {
  auto session = std::make_shared<SessionHold>(parts.store, request.simulation(), frame.caller,
                                               frame.call, Access::observe);
  const Recorder& record = (*session)->record();
  return [session, &record, at = std::size_t{0}](auto* reply) mutable {
    std::string piece = record.read(at, kChunkBytes);
    at += piece.size();
    const bool some = !piece.empty();
    reply->set_data(std::move(piece));
    return some ? Next::message : Next::nothing;
  };
}

void add_saved(Gate& gate, const Parts& parts) {
  gate.add(
      simulations_path("CreateSnapshot"),
      on_session<v1::CreateSnapshotRequest, v1::CreateSnapshotReply>(
          parts, Role::control, Lane::work,
          [](Session& session, const auto& request, auto* reply, const Session::Change& change) {
            session.save(request.display_name(), change, reply);
          }));
  gate.add(simulations_path("ListSnapshots"),
           on_session<v1::ListSnapshotsRequest, v1::ListSnapshotsReply>(
               parts, Role::observe, Lane::work, [](Session& session, const auto&, auto* reply) {
                 session.snapshots().list(reply);
               }));
  gate.add(
      simulations_path("RestoreSnapshot"),
      on_session<v1::RestoreSnapshotRequest, v1::RestoreSnapshotReply>(
          parts, Role::control, Lane::work,
          [](Session& session, const auto& request, auto* reply, const Session::Change& change) {
            session.restore(snapshot_in(request), change, reply);
          }));
  gate.add(simulations_path("ResetSimulation"),
           on_session<v1::ResetSimulationRequest, v1::ResetSimulationReply>(
               parts, Role::control, Lane::heavy,
               [](Session& session, const auto&, auto* reply, const Session::Change& change) {
                 const CallToken token(change.call);
                 session.reset(change, token, reply);
               }));
  gate.add(
      simulations_path("DeleteSnapshot"),
      on_session<v1::DeleteSnapshotRequest, v1::DeleteSnapshotReply>(
          parts, Role::control, Lane::work,
          [](Session& session, const auto& request, auto* reply, const Session::Change& change) {
            session.forget(snapshot_in(request), change, reply);
          }));
}

}  // namespace

void add_snapshots(Gate& gate, const Parts& parts) {
  add_saved(gate, parts);
  gate.add(simulations_path("ExportSnapshot"),
           series<v1::ExportSnapshotRequest, v1::ExportSnapshotReply>(
               Role::observe, Lane::work, [&parts](const CallFrame& frame, const auto& request) {
                 return exported_snapshot(parts, frame, request);
               }));
  gate.add(simulations_path("ImportSnapshot"),
           stream(Role::control, [&parts] { return std::make_unique<SnapshotImport>(parts); }));
  gate.add(
      simulations_path("ImportSnapshotInline"),
      on_session<v1::ImportSnapshotInlineRequest, v1::ImportSnapshotInlineReply>(
          parts, Role::control, Lane::work,
          [](Session& session, const auto& request, auto* reply, const Session::Change& change) {
            session.import_state(request.data(), request.display_name(), request.restore(), change,
                                 *reply, reply->mutable_snapshot());
          }));
  gate.add(simulations_path("GetRecord"),
           series<v1::GetRecordRequest, v1::GetRecordReply>(
               Role::observe, Lane::work, [&parts](const CallFrame& frame, const auto& request) {
                 return recorded(parts, frame, request);
               }));
}

}  // namespace mbcosim::server
