/// Handlers of `mbcosim.v1.Simulations`: convert, call the session, convert back.
#pragma once

#include "mbcosim/v1/simulations.grpc.pb.h"
#include "service/service_base.h"

namespace mbcosim::server {

class SimulationsService final : public v1::Simulations::Service {
 public:
  explicit SimulationsService(Parts parts) : parts_(parts) {}

  using Context = grpc::ServerContext*;
  using Status = grpc::Status;
  using StepStreamer = grpc::ServerReaderWriter<v1::StepReply, v1::StepRequest>;

  Status GetServerInfo(Context, const v1::GetServerInfoRequest*, v1::ServerInfo*) override;
  Status CreateSimulation(Context, grpc::ServerReader<v1::UploadRequest>*,
                          v1::CreateSimulationReply*) override;
  Status ValidateModel(Context, grpc::ServerReader<v1::UploadRequest>*,
                       v1::ValidateModelReply*) override;
  Status GetSimulation(Context, const v1::GetSimulationRequest*, v1::SimulationInfo*) override;
  Status UpdateSimulation(Context, const v1::UpdateSimulationRequest*,
                          v1::SimulationInfo*) override;
  Status GetRecord(Context, const v1::GetRecordRequest*,
                   grpc::ServerWriter<v1::GetRecordReply>*) override;
  Status ListSimulations(Context, const v1::ListSimulationsRequest*,
                         v1::ListSimulationsReply*) override;
  Status DeleteSimulation(Context, const v1::DeleteSimulationRequest*,
                          v1::DeleteSimulationReply*) override;
  Status DescribeSimulation(Context, const v1::DescribeSimulationRequest*,
                            v1::ModelDescription*) override;
  Status Step(Context, const v1::StepRequest*, v1::StepReply*) override;
  Status StepStream(Context, StepStreamer*) override;
  Status Run(Context, const v1::RunRequest*, grpc::ServerWriter<v1::RunReply>*) override;
  Status Interrupt(Context, const v1::InterruptRequest*, v1::InterruptReply*) override;
  Status ReadVariables(Context, const v1::ReadVariablesRequest*, v1::ReadVariablesReply*) override;
  Status WriteVariables(Context, const v1::WriteVariablesRequest*,
                        v1::WriteVariablesReply*) override;
  Status CreateSnapshot(Context, const v1::CreateSnapshotRequest*, v1::Snapshot*) override;
  Status RestoreSnapshot(Context, const v1::RestoreSnapshotRequest*, v1::SimulationInfo*) override;
  Status ListSnapshots(Context, const v1::ListSnapshotsRequest*, v1::ListSnapshotsReply*) override;
  Status DeleteSnapshot(Context, const v1::DeleteSnapshotRequest*,
                        v1::DeleteSnapshotReply*) override;
  Status ExportSnapshot(Context, const v1::ExportSnapshotRequest*,
                        grpc::ServerWriter<v1::ExportSnapshotReply>*) override;
  Status ImportSnapshot(Context, grpc::ServerReader<v1::ImportSnapshotRequest>*,
                        v1::Snapshot*) override;
  Status ForkSimulation(Context, const v1::ForkSimulationRequest*,
                        v1::CreateSimulationReply*) override;
  Status Linearize(Context, const v1::LinearizeRequest*, v1::LinearizeReply*) override;
  Status ComputeEigenvalues(Context, const v1::ComputeEigenvaluesRequest*,
                            v1::ComputeEigenvaluesReply*) override;

 private:
  Session::Identity make_identity(const v1::CreateOptions& options, const Caller& caller) const;
  void create(const v1::UploadHeader& header, LoadReport report, Call& call, const Caller& caller,
              v1::CreateSimulationReply* reply);
  SessionPtr add(const v1::CreateOptions& options, const Caller& caller,
                 std::unique_ptr<Simulation> simulation);
  /// Session and number of a snapshot named by the client.
  std::pair<SessionPtr, int> find_snapshot(const std::string& name, const Caller& caller) const;

  Parts parts_;
};

}  // namespace mbcosim::server
