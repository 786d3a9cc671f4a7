/// A recorded server against a client: what the server sent is sent again, what the client answers
/// is compared.
#pragma once

#include <grpcpp/server_context.h>

#include <map>
#include <string>
#include <vector>

#include "mbcosim/v1/coupling.grpc.pb.h"
#include "mbcosim/v1/record.pb.h"
#include "mbcosim/v1/simulations.grpc.pb.h"
#include "threads/mutex.h"

namespace mbcosim::replay {

/// Plays the part of the server on every port of a record. Thread-safe.
class RecordedCoupling final : public v1::Coupling::Service {
 public:
  RecordedCoupling(const std::vector<v1::RecordEntry>& record, double tolerance);
  grpc::Status Attach(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<v1::ServerMessage, v1::PeerMessage>* stream) override;

  std::size_t sessions() const;  ///< not yet played
  /// Waits until the sessions of all ports were played, or the first difference.
  void wait();
  std::string difference() const;  ///< the first one; empty: none
  std::int64_t exchanges() const;  ///< compared

 private:
  using Stream = grpc::ServerReaderWriter<v1::ServerMessage, v1::PeerMessage>;
  using Entries = std::vector<const v1::RecordEntry*>;
  const Entries* next_session(const std::string& port);
  void play(const std::string& port, const Entries& entries, Stream* stream);
  bool compare(const std::string& port, const v1::RecordEntry* recorded,
               const v1::PeerMessage& now);
  void note(const std::string& port, const std::string& what);

  const double tolerance_;
  std::map<std::string, std::vector<Entries>> sessions_;  ///< of each port, from welcome to the end
  mutable server::Mutex mutex_;
  server::Condition changed_;
  std::map<std::string, std::size_t> played_ TS_GUARDED_BY(mutex_);
  std::size_t left_ TS_GUARDED_BY(mutex_) = 0;
  std::int64_t exchanges_ TS_GUARDED_BY(mutex_) = 0, step_ TS_GUARDED_BY(mutex_) = 0;
  std::string difference_ TS_GUARDED_BY(mutex_);
};

/// Enough of a server for clients that look before they attach.
class RecordedSimulation final : public v1::Simulations::Service {
 public:
  explicit RecordedSimulation(const v1::RecordHeader& header) : header_(header) {}
  grpc::Status GetServerInfo(grpc::ServerContext*, const v1::GetServerInfoRequest*,
                             v1::GetServerInfoReply* reply) override;
  grpc::Status GetSimulation(grpc::ServerContext*, const v1::GetSimulationRequest* request,
                             v1::GetSimulationReply* reply) override;
  grpc::Status DescribeSimulation(grpc::ServerContext*, const v1::DescribeSimulationRequest*,
                                  v1::DescribeSimulationReply* reply) override;

 private:
  const v1::RecordHeader& header_;
};

}  // namespace mbcosim::replay
