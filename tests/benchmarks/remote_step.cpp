/// Cost of a remote step on an open stream, beside an empty echo on a stream of the same messages
/// and a step in this process.
///
/// usage: remote_step ADDRESS [Google Benchmark options]
/// ADDRESS is that of a running mbcosimd; see remote_step.sh.
#include <benchmark/benchmark.h>
#include <grpcpp/grpcpp.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include "mbcosim/v1/simulations.grpc.pb.h"
#include "simulation/simulation.h"

namespace {

namespace v1 = mbcosim::v1;

const char* const kDeck =
    "begin: data; problem: initial value; end: data;"
    "begin: initial value; initial time: 0.; final time: forever; time step: 1.e-3; method: ms, "
    ".6; tolerance: 1.e-9;"
    " max iterations: 20; end: initial value;"
    "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;"
    "begin: nodes; structural: 1, dynamic, null, eye, null, .01, 2., .01; end: nodes;"
    "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;";

/// Answers each request of the stream with an empty reply.
class Echo final : public v1::Simulations::Service {
  grpc::Status StepStream(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StepStreamReply, v1::StepRequest>* stream) override {
    v1::StepRequest request;
    while (stream->Read(&request)) stream->Write(v1::StepStreamReply());
    return grpc::Status::OK;
  }
};

std::string daemon_address;

std::shared_ptr<grpc::Channel> open(const std::string& address) {
  return grpc::CreateChannel(address, grpc::InsecureChannelCredentials());
}

/// The name of a new simulation of kDeck; empty when the daemon refuses.
std::string create(v1::Simulations::Stub& stub) {
  grpc::ClientContext context;
  v1::CreateSimulationReply reply;
  const auto upload = stub.CreateSimulation(&context, &reply);
  v1::UploadRequest request;
  request.mutable_header()->set_bundle_main_file("body.mbd");
  upload->Write(request);
  request.mutable_chunk()->set_path("body.mbd");
  request.mutable_chunk()->set_data(kDeck);
  upload->Write(request);
  upload->WritesDone();
  const grpc::Status status = upload->Finish();
  if (!status.ok()) std::fprintf(stderr, "error: %s\n", status.error_message().c_str());
  return status.ok() ? reply.simulation().name() : "";
}

/// One request and its reply at a time.
void exchange(benchmark::State& state, v1::Simulations::Stub& stub, const std::string& simulation) {
  grpc::ClientContext context;
  const auto stream = stub.StepStream(&context);
  v1::StepRequest request;
  request.set_simulation(simulation);
  v1::StepStreamReply reply;
  for (auto _ : state)
    if (!stream->Write(request) || !stream->Read(&reply)) state.SkipWithError("the stream ended");
  stream->WritesDone();
  (void)stream->Finish();
}

void empty_echo(benchmark::State& state) {
  Echo service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  v1::Simulations::Stub stub(open("127.0.0.1:" + std::to_string(port)));
  exchange(state, stub, "");
  server->Shutdown();
}
BENCHMARK(empty_echo)->UseRealTime()->Unit(benchmark::kMicrosecond);

void remote_step(benchmark::State& state) {
  v1::Simulations::Stub stub(open(daemon_address));
  const std::string simulation = create(stub);
  if (simulation.empty()) return state.SkipWithError("no simulation");
  exchange(state, stub, simulation);
}
BENCHMARK(remote_step)->UseRealTime()->Unit(benchmark::kMicrosecond);

void local_step(benchmark::State& state) {
  const mbcosim::LoadReport report = mbcosim::load_deck(
      mbcosim::BundleSource(std::map<std::string, std::string>{{"body.mbd", kDeck}}), "body.mbd");
  auto simulation = mbcosim::Simulation::create(report.model);
  for (auto _ : state) (*simulation)->step();
}
BENCHMARK(local_step)->UseRealTime()->Unit(benchmark::kMicrosecond);

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') {
    std::fprintf(stderr, "usage: remote_step ADDRESS [Google Benchmark options]\n");
    return 4;
  }
  daemon_address = argv[1];
  --argc;
  ++argv;
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
