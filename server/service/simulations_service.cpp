#include "service/simulations_service.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>

#include "service/upload.h"
#include "wire/convert.h"
#include "wire/protocol.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
using google::protobuf::util::TimeUtil;
constexpr std::size_t kChunkBytes = 1 << 20;

void check_protocol(const v1::VersionRange& range) {
  if (range.lowest() == 0 && range.highest() == 0) return;
  if (range.lowest() <= kProtocolVersion && kProtocolVersion <= range.highest()) return;
  const std::string version = std::to_string(kProtocolVersion);
  throw Refusal(v1::REASON_VERSION_MISMATCH,
                "the server speaks protocol version " + version + ", the client " +
                    std::to_string(range.lowest()) + " to " + std::to_string(range.highest()),
                {{"lowest", version}, {"highest", version}});
}

void check_options(const v1::CreateOptions& options) { check_protocol(options.protocol()); }

[[noreturn]] void refuse_deck(const LoadReport& report) {
  Error error;
  error.kind = ErrorKind::deck;
  error.diagnostics = report.diagnostics;
  const auto first =
      std::find_if(report.diagnostics.begin(), report.diagnostics.end(),
                   [](const Diagnostic& d) { return d.severity == Severity::error; });
  if (first == report.diagnostics.end()) {
    error.message = "the deck cannot be read";
  } else {
    error.message = utf8(first->file + ":" + std::to_string(first->line) + ":" +
                         std::to_string(first->column) + ": error: " + first->message);
    constexpr std::string_view kLimit = "limit-";
    if (first->code == "port") throw Refusal(v1::REASON_BAD_ARGUMENT, utf8(first->message));
    if (first->code.compare(0, kLimit.size(), kLimit) == 0) {
      error.kind = ErrorKind::limit;
      error.reason = first->code.substr(kLimit.size());
      std::replace(error.reason.begin(), error.reason.end(), '-', '_');
    }
  }
  throw Refusal(error);
}

void add_limit(v1::ServerInfo* info, const char* name, std::int64_t maximum) {
  v1::Limit* limit = info->add_limits();
  limit->set_name(name);
  limit->set_maximum(maximum);
}

/// Sends progress of a run at an even pace.
class ProgressReporter {
 public:
  ProgressReporter(const Session& session, const v1::RunRequest& request,
                   grpc::ServerWriter<v1::RunReply>* writer)
      : session_(session), writer_(writer) {
    session_.fill(&info_);
    start_step_ = info_.step();
    start_time_ = info_.time_s();
    steps_ = request.step().has_steps() ? request.step().steps() : -1;
    end_time_ = info_.final_time_s();
    if (request.step().has_until_time_s())
      end_time_ = std::min(end_time_, request.step().until_time_s());
    const auto wanted = request.has_progress_interval()
                            ? TimeUtil::DurationToMilliseconds(request.progress_interval())
                            : 500;
    interval_ = std::chrono::milliseconds(std::max<std::int64_t>(wanted, 20));
  }

  void operator()() {
    const Clock::time_point now = Clock::now();
    if (now - last_ < interval_) return;
    last_ = now;
    session_.fill(&info_);
    const double elapsed = std::chrono::duration<double>(now - started_).count();
    const double fraction = done_fraction();
    v1::RunProgress* progress = message_.mutable_progress();
    progress->set_step(info_.step());
    progress->set_time_s(info_.time_s());
    progress->set_fraction(fraction);
    progress->set_remaining_seconds(fraction > 0 ? elapsed * (1 - fraction) / fraction : -1);
    writer_->Write(message_);
  }

 private:
  double done_fraction() const {
    double fraction = -1;
    if (steps_ > 0)
      fraction = static_cast<double>(info_.step() - start_step_) / static_cast<double>(steps_);
    if (std::isfinite(end_time_) && end_time_ > start_time_)
      fraction = std::max(fraction, (info_.time_s() - start_time_) / (end_time_ - start_time_));
    return std::min(fraction, 1.0);
  }

  const Session& session_;
  grpc::ServerWriter<v1::RunReply>* writer_;
  v1::SimulationInfo info_;
  v1::RunReply message_;
  std::int64_t start_step_ = 0, steps_ = -1;
  double start_time_ = 0, end_time_ = 0;
  std::chrono::milliseconds interval_{500};
  Clock::time_point started_ = Clock::now(), last_ = started_;
};

}  // namespace

// ------------------------------------------------------------------ server

grpc::Status SimulationsService::GetServerInfo(Context context, const v1::GetServerInfoRequest*,
                                               v1::ServerInfo* reply) {
  return serve(parts_, *context, "GetServerInfo", Role::observe, [&](const Caller& caller) {
    const ServiceLimits& limits = parts_.config.limits;
    reply->set_version(MBCOSIM_VERSION);
    reply->mutable_protocol()->set_lowest(kProtocolVersion);
    reply->mutable_protocol()->set_highest(kProtocolVersion);
    add_limit(reply, "sessions", limits.sessions);
    add_limit(reply, "snapshots", limits.snapshots);
    add_limit(reply, "snapshot_bytes", limits.snapshot_bytes);
    add_limit(reply, "message_bytes", limits.message_bytes);
    add_limit(reply, "bundle_files", limits.bundle_files);
    add_limit(reply, "record_bytes", limits.record_bytes);
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
    reply->set_identity(caller.identity);
    reply->set_role(role_name(caller.role));
  });
}

// ------------------------------------------------------------------ life

Session::Identity SimulationsService::make_identity(const v1::CreateOptions& options,
                                                    const Caller& caller) const {
  Session::Identity identity;
  identity.id = SessionStore::new_id();
  identity.display_name = options.display_name();
  identity.owner = caller.identity;
  identity.request_id = options.request_id();
  identity.lease = parts_.config.limits.lease;
  if (options.has_lease()) {
    const std::chrono::milliseconds lease(TimeUtil::DurationToMilliseconds(options.lease()));
    if (lease <= std::chrono::milliseconds(0))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`lease` must be positive");
    if (lease > identity.lease)
      throw limit_refusal("lease_seconds", parts_.config.limits.lease.count(),
                          "the lease is longer than allowed");
    identity.lease = lease;
  }
  return identity;
}

SessionPtr SimulationsService::add(const v1::CreateOptions& options, const Caller& caller,
                                   std::unique_ptr<Simulation> simulation) {
  auto session = std::make_shared<Session>(
      make_identity(options, caller), std::move(simulation),
      Session::Shared{parts_.slots, parts_.config.limits, parts_.metrics}, options);
  parts_.store.add(session);
  return session;
}

void SimulationsService::create(const v1::UploadHeader& header, LoadReport report, Call& call,
                                const Caller& caller, v1::CreateSimulationReply* reply) {
  if (!report.ok()) refuse_deck(report);
  CancelToken token;
  call.attach(&token);
  auto simulation = [&] {
    const auto slot = parts_.slots.acquire(token);
    const bool summed = header.options().summed_time();
    return Simulation::create(report.model, &token, nullptr,
                              summed ? TimeKeeping::summed : TimeKeeping::exact);
  }();
  call.attach(nullptr);
  if (!simulation) throw Refusal(simulation.error());
  add(header.options(), caller, std::move(*simulation))->fill(reply->mutable_simulation());
  to_proto(report.diagnostics, reply->mutable_diagnostics());
  reply->set_printed(utf8(report.printed));
  reply->set_protocol_version(kProtocolVersion);
}

grpc::Status SimulationsService::CreateSimulation(Context context,
                                                  grpc::ServerReader<v1::UploadRequest>* reader,
                                                  v1::CreateSimulationReply* reply) {
  return serve(parts_, *context, "CreateSimulation", Role::control, [&](const Caller& caller) {
    Call call(parts_.watch, *context);
    const Upload upload = read_upload(reader, parts_.config.limits);
    const v1::CreateOptions& options = upload.header.options();
    check_options(options);
    if (const SessionPtr known = parts_.store.find_request(options.request_id(), caller)) {
      known->fill(reply->mutable_simulation());
      reply->set_protocol_version(kProtocolVersion);
      return;
    }
    const SessionStore::Place place(parts_.store);
    create(upload.header, load(upload, parts_.config), call, caller, reply);
  });
}

grpc::Status SimulationsService::ValidateModel(Context context,
                                               grpc::ServerReader<v1::UploadRequest>* reader,
                                               v1::ValidateModelReply* reply) {
  return serve(parts_, *context, "ValidateModel", Role::observe, [&](const Caller&) {
    const LoadReport report = load(read_upload(reader, parts_.config.limits), parts_.config);
    reply->set_ok(report.ok());
    to_proto(report.diagnostics, reply->mutable_diagnostics());
    reply->set_printed(utf8(report.printed));
    if (report.ok()) to_proto(*report.model, reply->mutable_description());
  });
}

grpc::Status SimulationsService::GetSimulation(Context context,
                                               const v1::GetSimulationRequest* request,
                                               v1::SimulationInfo* reply) {
  return serve(parts_, *context, "GetSimulation", Role::observe, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->name(), caller);
    const Session::Use use(*session);
    session->fill(reply);
  });
}

grpc::Status SimulationsService::UpdateSimulation(Context context,
                                                  const v1::UpdateSimulationRequest* request,
                                                  v1::SimulationInfo* reply) {
  return serve(parts_, *context, "UpdateSimulation", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->name(), caller);
    const Session::Use use(*session);
    session->update(*request);
    session->fill(reply);
  });
}

grpc::Status SimulationsService::GetRecord(Context context, const v1::GetRecordRequest* request,
                                           grpc::ServerWriter<v1::GetRecordReply>* writer) {
  return serve(parts_, *context, "GetRecord", Role::observe, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->name(), caller);
    const Session::Use use(*session);
    v1::GetRecordReply reply;
    session->record().read(kChunkBytes, [&](const std::string& piece) {
      reply.set_data(piece);
      return writer->Write(reply);
    });
  });
}

grpc::Status SimulationsService::ListSimulations(Context context,
                                                 const v1::ListSimulationsRequest* request,
                                                 v1::ListSimulationsReply* reply) {
  return serve(parts_, *context, "ListSimulations", Role::observe, [&](const Caller& caller) {
    const std::vector<SessionPtr> sessions = parts_.store.list(caller);
    const std::size_t page =
        request->page_size() > 0 ? static_cast<std::size_t>(request->page_size()) : 100;
    auto next = sessions.begin();
    if (!request->page_token().empty()) {
      next = std::find_if(sessions.begin(), sessions.end(), [&](const SessionPtr& s) {
        return s->identity().id == request->page_token();
      });
      if (next == sessions.end())
        throw Refusal(v1::REASON_BAD_ARGUMENT,
                      "`page_token` is not one of the server's, or has expired");
    }
    for (; next != sessions.end(); ++next) {
      if (static_cast<std::size_t>(reply->simulations_size()) == page) {
        reply->set_next_page_token((*next)->identity().id);
        return;
      }
      (*next)->fill(reply->add_simulations());
    }
  });
}

grpc::Status SimulationsService::DeleteSimulation(Context context,
                                                  const v1::DeleteSimulationRequest* request,
                                                  v1::DeleteSimulationReply*) {
  return serve(parts_, *context, "DeleteSimulation", Role::control,
               [&](const Caller& caller) { parts_.store.remove(request->name(), caller); });
}

grpc::Status SimulationsService::DescribeSimulation(Context context,
                                                    const v1::DescribeSimulationRequest* request,
                                                    v1::ModelDescription* reply) {
  return serve(parts_, *context, "DescribeSimulation", Role::observe, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->name(), caller);
    const Session::Use use(*session);
    session->fill(reply, request->variable_prefix());
  });
}

// ------------------------------------------------------------------ advancing

grpc::Status SimulationsService::Step(Context context, const v1::StepRequest* request,
                                      v1::StepReply* reply) {
  return serve(parts_, *context, "Step", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    Call call(parts_.watch, *context);
    session->step(*request, call, reply);
  });
}

grpc::Status SimulationsService::StepStream(Context context, StepStreamer* stream) {
  return serve(parts_, *context, "StepStream", Role::control, [&](const Caller& caller) {
    v1::StepRequest request;
    v1::StepReply reply;
    if (!stream->Read(&request)) return;
    const std::string name = request.simulation();
    const SessionPtr session = parts_.store.get(name, caller);
    const Session::Use use(*session);
    Call call(parts_.watch, *context);
    do {
      if (!request.simulation().empty() && request.simulation() != name)
        throw Refusal(v1::REASON_BAD_ARGUMENT,
                      "all messages of a stream must name the same simulation");
      reply.Clear();
      session->step(request, call, &reply);
    } while (stream->Write(reply) && stream->Read(&request));
  });
}

grpc::Status SimulationsService::Run(Context context, const v1::RunRequest* request,
                                     grpc::ServerWriter<v1::RunReply>* writer) {
  return serve(parts_, *context, "Run", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->step().simulation(), caller);
    const Session::Use use(*session);
    Call call(parts_.watch, *context);
    ProgressReporter report(*session, *request, writer);
    v1::RunReply done;
    session->step(request->step(), call, done.mutable_done(), [&] { report(); });
    writer->Write(done);
  });
}

grpc::Status SimulationsService::Interrupt(Context context, const v1::InterruptRequest* request,
                                           v1::InterruptReply* reply) {
  return serve(parts_, *context, "Interrupt", Role::control, [&](const Caller& caller) {
    reply->set_was_stepping(parts_.store.get(request->name(), caller)->interrupt());
  });
}

grpc::Status SimulationsService::ReadVariables(Context context,
                                               const v1::ReadVariablesRequest* request,
                                               v1::ReadVariablesReply* reply) {
  return serve(parts_, *context, "ReadVariables", Role::observe, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    session->read(*request, reply);
  });
}

grpc::Status SimulationsService::WriteVariables(Context context,
                                                const v1::WriteVariablesRequest* request,
                                                v1::WriteVariablesReply* reply) {
  return serve(parts_, *context, "WriteVariables", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    session->write(*request, reply);
  });
}

// ------------------------------------------------------------------ snapshots

std::pair<SessionPtr, int> SimulationsService::find_snapshot(const std::string& name,
                                                             const Caller& caller) const {
  std::string simulation;
  const int number = split_snapshot_name(name, &simulation);
  if (number < 0)
    throw Refusal(v1::REASON_NO_SUCH_SNAPSHOT,
                  "no snapshot is named \"" + name.substr(0, 100) + "\"");
  return {parts_.store.get(simulation, caller), number};
}

grpc::Status SimulationsService::CreateSnapshot(Context context,
                                                const v1::CreateSnapshotRequest* request,
                                                v1::Snapshot* reply) {
  return serve(parts_, *context, "CreateSnapshot", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    session->save(request->display_name(), reply);
  });
}

grpc::Status SimulationsService::RestoreSnapshot(Context context,
                                                 const v1::RestoreSnapshotRequest* request,
                                                 v1::SimulationInfo* reply) {
  return serve(parts_, *context, "RestoreSnapshot", Role::control, [&](const Caller& caller) {
    const auto [session, number] = find_snapshot(request->name(), caller);
    const Session::Use use(*session);
    session->restore(number);
    session->fill(reply);
  });
}

grpc::Status SimulationsService::ListSnapshots(Context context,
                                               const v1::ListSnapshotsRequest* request,
                                               v1::ListSnapshotsReply* reply) {
  return serve(parts_, *context, "ListSnapshots", Role::observe, [&](const Caller& caller) {
    parts_.store.get(request->simulation(), caller)->snapshots().list(reply);
  });
}

grpc::Status SimulationsService::DeleteSnapshot(Context context,
                                                const v1::DeleteSnapshotRequest* request,
                                                v1::DeleteSnapshotReply*) {
  return serve(parts_, *context, "DeleteSnapshot", Role::control, [&](const Caller& caller) {
    const auto [session, number] = find_snapshot(request->name(), caller);
    session->snapshots().remove(number);
  });
}

grpc::Status SimulationsService::ExportSnapshot(
    Context context, const v1::ExportSnapshotRequest* request,
    grpc::ServerWriter<v1::ExportSnapshotReply>* writer) {
  return serve(parts_, *context, "ExportSnapshot", Role::observe, [&](const Caller& caller) {
    auto [session, number] = request->has_snapshot()
                                 ? find_snapshot(request->snapshot(), caller)
                                 : std::pair(parts_.store.get(request->simulation(), caller), -1);
    const Session::Use use(*session);
    const std::string bytes = session->export_state(number);
    v1::ExportSnapshotReply reply;
    for (std::size_t at = 0; at < bytes.size(); at += kChunkBytes) {
      reply.set_data(bytes.substr(at, kChunkBytes));
      if (!writer->Write(reply)) return;
    }
  });
}

grpc::Status SimulationsService::ImportSnapshot(
    Context context, grpc::ServerReader<v1::ImportSnapshotRequest>* reader, v1::Snapshot* reply) {
  return serve(parts_, *context, "ImportSnapshot", Role::control, [&](const Caller& caller) {
    v1::ImportSnapshotRequest message;
    if (!reader->Read(&message) || !message.has_header())
      throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an import must be `header`");
    const v1::ImportSnapshotHeader header = message.header();
    const SessionPtr session = parts_.store.get(header.simulation(), caller);
    const Session::Use use(*session);
    std::string bytes;
    while (reader->Read(&message)) {
      if (message.has_header())
        throw Refusal(v1::REASON_OUT_OF_TURN, "after `header` an import has only `data` messages");
      bytes += message.data();
      if (static_cast<std::int64_t>(bytes.size()) > parts_.config.limits.snapshot_bytes)
        throw limit_refusal("snapshot_bytes", parts_.config.limits.snapshot_bytes,
                            "the snapshot is larger than allowed");
    }
    session->import_state(bytes, header.display_name(), header.restore(), reply);
  });
}

grpc::Status SimulationsService::ForkSimulation(Context context,
                                                const v1::ForkSimulationRequest* request,
                                                v1::CreateSimulationReply* reply) {
  return serve(parts_, *context, "ForkSimulation", Role::control, [&](const Caller& caller) {
    check_options(request->options());
    const SessionPtr known = parts_.store.find_request(request->options().request_id(), caller);
    if (!known) {
      auto [session, number] = request->has_snapshot()
                                   ? find_snapshot(request->snapshot(), caller)
                                   : std::pair(parts_.store.get(request->simulation(), caller), -1);
      const Session::Use use(*session);
      const SessionStore::Place place(parts_.store);
      add(request->options(), caller, session->fork(number))->fill(reply->mutable_simulation());
    } else {
      known->fill(reply->mutable_simulation());
    }
    reply->set_protocol_version(kProtocolVersion);
  });
}

// ------------------------------------------------------------------ analysis

grpc::Status SimulationsService::Linearize(Context context, const v1::LinearizeRequest* request,
                                           v1::LinearizeReply* reply) {
  return serve(parts_, *context, "Linearize", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    session->linearize(*request, reply);
  });
}

grpc::Status SimulationsService::ComputeEigenvalues(Context context,
                                                    const v1::ComputeEigenvaluesRequest* request,
                                                    v1::ComputeEigenvaluesReply* reply) {
  return serve(parts_, *context, "ComputeEigenvalues", Role::control, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    session->eigenvalues(*request, reply);
  });
}

}  // namespace mbcosim::server
