#include "replay/server_replay.h"

#include "replay/record_file.h"

namespace mbcosim::replay {

RecordedCoupling::RecordedCoupling(const std::vector<v1::RecordEntry>& record, double tolerance)
    : tolerance_(tolerance) {
  for (const v1::RecordEntry& entry : record) {
    if (entry.port().empty() || entry.from_peer().has_hello()) continue;
    auto& sessions = sessions_[entry.port()];
    if (entry.to_peer().has_welcome()) {
      sessions.emplace_back();
      ++left_;
    }
    if (!sessions.empty()) sessions.back().push_back(&entry);
  }
}

const RecordedCoupling::Entries* RecordedCoupling::next_session(const std::string& port) {
  const server::Guard guard(mutex_);
  const auto found = sessions_.find(port);
  if (found == sessions_.end() || played_[port] >= found->second.size()) return nullptr;
  return &found->second[played_[port]++];
}

grpc::Status RecordedCoupling::Attach(grpc::ServerContext*, Stream* stream) {
  v1::PeerMessage first;
  if (!stream->Read(&first) || !first.has_hello())
    return {grpc::StatusCode::FAILED_PRECONDITION, "the first message must be `hello`"};
  const std::string port = first.hello().port();
  const Entries* entries = next_session(port);
  if (!entries)
    return {grpc::StatusCode::NOT_FOUND,
            "the record has no further session of port \"" + port.substr(0, 100) + "\""};
  play(port, *entries, stream);
  {
    const server::Guard guard(mutex_);
    --left_;
  }
  changed_.notify_all();
  return grpc::Status::OK;
}

void RecordedCoupling::play(const std::string& port, const Entries& entries, Stream* stream) {
  for (std::size_t k = 0; k < entries.size(); ++k) {
    if (entries[k]->detached()) return;
    if (!entries[k]->has_to_peer()) continue;
    const v1::ServerMessage& message = entries[k]->to_peer();
    if (!stream->Write(message)) return note(port, "the client left before the record did");
    if (!message.has_exchange()) continue;
    {
      const server::Guard guard(mutex_);
      step_ = message.exchange().step();
    }
    const v1::RecordEntry* answer =
        k + 1 < entries.size() && entries[k + 1]->from_peer().has_exchange() ? entries[k + 1]
                                                                             : nullptr;
    if (!answer) continue;  // nobody answered then
    v1::PeerMessage now;
    do {
      if (!stream->Read(&now)) return note(port, "the client left before the record did");
    } while (now.has_heartbeat());
    if (!compare(port, answer, now)) return;
  }
}

bool RecordedCoupling::compare(const std::string& port, const v1::RecordEntry* recorded,
                               const v1::PeerMessage& now) {
  {
    const server::Guard guard(mutex_);
    ++exchanges_;
  }
  const auto difference = first_difference(recorded->from_peer(), now, tolerance_);
  if (difference) note(port, *difference);
  return !difference;
}

void RecordedCoupling::note(const std::string& port, const std::string& what) {
  {
    const server::Guard guard(mutex_);
    if (difference_.empty())
      difference_ = "step " + std::to_string(step_) + ", port \"" + port + "\": " + what;
  }
  changed_.notify_all();
}

std::size_t RecordedCoupling::sessions() const {
  const server::Guard guard(mutex_);
  return left_;
}

void RecordedCoupling::wait() {
  const server::Guard guard(mutex_);
  while (left_ > 0 && difference_.empty()) changed_.wait(mutex_);
}

std::string RecordedCoupling::difference() const {
  const server::Guard guard(mutex_);
  return difference_;
}

std::int64_t RecordedCoupling::exchanges() const {
  const server::Guard guard(mutex_);
  return exchanges_;
}

grpc::Status RecordedSimulation::GetServerInfo(grpc::ServerContext*,
                                               const v1::GetServerInfoRequest*,
                                               v1::GetServerInfoReply* reply) {
  reply->set_version(MBCOSIM_VERSION);
  reply->mutable_protocol()->set_lowest(header_.protocol_version());
  reply->mutable_protocol()->set_highest(header_.protocol_version());
  reply->set_identity("replay");
  reply->set_role("control");
  return grpc::Status::OK;
}

grpc::Status RecordedSimulation::GetSimulation(grpc::ServerContext*,
                                               const v1::GetSimulationRequest* request,
                                               v1::GetSimulationReply* out) {
  v1::SimulationInfo* reply = out->mutable_simulation();
  reply->set_name(request->simulation());
  reply->set_display_name("a record");
  reply->set_state(v1::SIMULATION_STATE_READY);
  reply->set_step(header_.step());
  reply->set_time(header_.time());
  reply->set_model_digest(header_.model_digest());
  return grpc::Status::OK;
}

grpc::Status RecordedSimulation::DescribeSimulation(grpc::ServerContext*,
                                                    const v1::DescribeSimulationRequest*,
                                                    v1::DescribeSimulationReply* out) {
  v1::ModelDescription* reply = out->mutable_model();
  reply->set_title("a record");
  reply->set_model_digest(header_.model_digest());
  *reply->mutable_ports() = header_.layouts();
  return grpc::Status::OK;
}

}  // namespace mbcosim::replay
