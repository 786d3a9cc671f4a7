/// What a step over an open stream costs: beside an echo of the same messages by gRPC alone, over a
/// Unix socket and loopback TCP, and one of many simulations that are stepped in turn beside one
/// alone. Starts `mbcosimd` from its own folder, and the echoes.
///
/// usage: remote_step [--turns N] [--exchanges N] [--many N] [--json FILE]
///
/// step          one step by the library's Stepper
/// echo, queue   by a completion queue that one thread polls: the quickest that gRPC has
/// echo, callback, sync   by its two other interfaces
/// engine        a step in this process
/// in turn       a step of the next of `--many` simulations, all on one stream
/// streams in turn   the same, each on a stream of its own
/// echoes in turn   an echo (queue, Unix socket) on the next of as many streams
///
/// All take turns of `--exchanges`. Of each: the median of the turns' medians, the lowest of them
/// and the 99th percentile of all [us]; processor time of both processes [us]. Of a step: medians
/// of (median - engine) / median of the echo in the same turn, and the same of the 99th
/// percentiles.
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <spawn.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "mbcosim/v1/simulations.grpc.pb.h"
#include "simulation/simulation.h"

namespace {

namespace v1 = mbcosim::v1;
namespace client = mbcosim::client;
using Clock = std::chrono::steady_clock;

const char* const kDeck =
    "begin: data; problem: initial value; end: data;"
    "begin: initial value; initial time: 0.; final time: forever; time step: 1.e-3; method: ms, "
    ".6; tolerance: 1.e-9;"
    " max iterations: 20; end: initial value;"
    "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;"
    "begin: nodes; structural: 1, dynamic, null, eye, null, .01, 2., .01; end: nodes;"
    "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;";
const char* const kOutput = "node.structural.1.X";

// ------------------------------------------------------------------ echoes

/// What a daemon sends for a step.
v1::StepStreamReply usual_reply() {
  constexpr double kNumber = 1.0 / 3;
  v1::StepStreamReply message;
  v1::StepReply* reply = message.mutable_step();
  reply->set_outcome(v1::STEP_OUTCOME_ACCEPTED);
  reply->set_steps_done(1);
  reply->set_step(1000);
  reply->set_time(kNumber);
  reply->set_step_size(kNumber);
  reply->set_iterations(2);
  reply->set_total_iterations(2);
  reply->set_residual_error(kNumber);
  reply->set_solver_seconds(kNumber);
  reply->set_pieces(1);
  reply->set_next_step_size(kNumber);
  reply->set_largest_step_size(kNumber);
  reply->set_total_seconds(kNumber);
  reply->mutable_outputs()->Resize(3, kNumber);
  return message;
}

grpc::ByteBuffer usual_bytes() {
  const grpc::Slice slice(usual_reply().SerializeAsString());
  return grpc::ByteBuffer(&slice, 1);
}

class SyncEcho final : public v1::Simulations::Service {
  grpc::Status StepStream(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StepStreamReply, v1::StepRequest>* stream) override {
    const v1::StepStreamReply reply = usual_reply();
    v1::StepRequest request;
    while (stream->Read(&request)) stream->Write(reply);
    return grpc::Status::OK;
  }
};

class CallbackEcho final : public grpc::CallbackGenericService {
  class Reactor final : public grpc::ServerGenericBidiReactor {
   public:
    Reactor() { StartRead(&in_); }
    void OnReadDone(bool ok) override { ok ? StartWrite(&out_) : Finish(grpc::Status::OK); }
    void OnWriteDone(bool) override { StartRead(&in_); }
    void OnDone() override { delete this; }

   private:
    grpc::ByteBuffer in_, out_ = usual_bytes();
  };
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    return new Reactor;
  }
};

class QueueEcho {
 public:
  explicit QueueEcho(grpc::ServerBuilder& builder) : queue_(builder.AddCompletionQueue()) {
    builder.RegisterAsyncGenericService(&service_);
  }
  void serve() {
    await_call();
    void* tag = nullptr;
    bool ok = false;
    while (queue_->Next(&tag, &ok)) static_cast<Stream*>(tag)->go_on(*this, ok);
  }

 private:
  /// One operation at a time.
  struct Stream {
    void go_on(QueueEcho& echo, bool ok) {
      if (!ok) return;  // rests until the process ends
      if (std::exchange(waits_for_call, false)) echo.await_call();
      if (std::exchange(has_read, !has_read))
        stream.Write(out, this);
      else
        stream.Read(&in, this);
    }
    grpc::GenericServerContext context;
    grpc::GenericServerAsyncReaderWriter stream{&context};
    grpc::ByteBuffer in, out = usual_bytes();
    bool waits_for_call = true, has_read = false;
  };
  void await_call() {
    Stream* next = streams_.emplace_back(std::make_unique<Stream>()).get();
    service_.RequestCall(&next->context, &next->stream, queue_.get(), queue_.get(), next);
  }

  grpc::AsyncGenericService service_;
  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  std::vector<std::unique_ptr<Stream>> streams_;
};

/// In a process of its own, until that is ended.
int serve_echo(const std::string& kind, const std::vector<std::string>& addresses) {
  grpc::ServerBuilder builder;
  for (const std::string& address : addresses)
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
  SyncEcho sync;
  CallbackEcho callback;
  std::unique_ptr<QueueEcho> queue;
  if (kind == "sync") builder.RegisterService(&sync);
  if (kind == "callback") builder.RegisterCallbackGenericService(&callback);
  if (kind == "queue") queue = std::make_unique<QueueEcho>(builder);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server) return 4;
  if (queue) queue->serve();
  server->Wait();
  return 0;
}

// ------------------------------------------------------------------ what is measured

double processor_seconds(clockid_t clock) {
  timespec time{};
  ::clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

class Process {
 public:
  Process(const std::string& program, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (::posix_spawn(&id_, program.c_str(), nullptr, nullptr, argv.data(), environ) != 0 ||
        ::clock_getcpuclockid(id_, &clock_) != 0) {
      std::fprintf(stderr, "error: cannot start %s\n", program.c_str());
      std::exit(4);
    }
  }
  ~Process() {
    ::kill(id_, SIGTERM);
    ::waitpid(id_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  double seconds() const { return processor_seconds(clock_); }

 private:
  pid_t id_ = 0;
  clockid_t clock_{};
};

/// One exchange and what it took, turn by turn.
class Lane {
 public:
  Lane(std::string name, std::function<void()> exchange, const Process* server)
      : name_(std::move(name)), exchange_(std::move(exchange)), server_(server) {}

  void take_turn(int exchanges) {
    for (int k = 0; k < exchanges / 10; ++k) exchange_();
    const double ours = processor_seconds(CLOCK_PROCESS_CPUTIME_ID);
    const double theirs = server_ ? server_->seconds() : 0;
    std::vector<double> turn;
    for (int k = 0; k < exchanges; ++k) {
      const Clock::time_point start = Clock::now();
      exchange_();
      turn.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
    }
    const double per_exchange = 1e6 / exchanges;
    client_.push_back(per_exchange * (processor_seconds(CLOCK_PROCESS_CPUTIME_ID) - ours));
    if (server_) processor_.push_back(per_exchange * (server_->seconds() - theirs));
    medians_.push_back(quantile(turn, 0.5));
    tails_.push_back(quantile(turn, 0.99));
    all_.insert(all_.end(), turn.begin(), turn.end());
  }

  const std::string& name() const { return name_; }
  const std::vector<double>& medians() const { return medians_; }
  const std::vector<double>& tails() const { return tails_; }
  std::map<std::string, double> figures() const {
    return {{"median", quantile(medians_, 0.5)},
            {"lowest", quantile(medians_, 0)},
            {"p99", quantile(all_, 0.99)},
            {"client", quantile(client_, 0.5)},
            {"server", quantile(processor_, 0.5)}};
  }

 private:
  const std::string name_;
  const std::function<void()> exchange_;
  const Process* const server_;
  std::vector<double> all_, medians_, tails_, client_, processor_;
};

/// Of (a - engine) / b, turn by turn.
double ratio(const std::vector<double>& a, const std::vector<double>& engine,
             const std::vector<double>& b) {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < a.size(); ++k)
    ratios.push_back((a[k] - (engine.empty() ? 0 : engine[k])) / b[k]);
  return quantile(ratios, 0.5);
}

// ------------------------------------------------------------------ exchanges

struct EchoStream {
  explicit EchoStream(const std::string& address)
      : EchoStream(grpc::CreateChannel(address, grpc::InsecureChannelCredentials())) {}
  explicit EchoStream(const std::shared_ptr<grpc::Channel>& channel)
      : stub(v1::Simulations::NewStub(channel)) {
    context.set_wait_for_ready(true);
    stream = stub->StepStream(&context);
    request.set_steps(1);
    request.add_outputs(1);
    request.set_simulation("simulations/0123456789abcdef-0123456789abcdef");
  }
  ~EchoStream() {
    context.TryCancel();
    (void)stream->Finish();
  }
  void exchange() {
    if (stream->Write(request) && stream->Read(&reply)) return;
    std::fprintf(stderr, "error: the echo has ended\n");
    std::exit(4);
  }
  grpc::ClientContext context;
  std::unique_ptr<v1::Simulations::Stub> stub;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StepRequest, v1::StepStreamReply>> stream;
  v1::StepRequest request;
  v1::StepStreamReply reply;
};

/// A simulation of the deck with an open stream, and one that it may share with others.
struct Stepped {
  explicit Stepped(client::Server& server, const client::Stepper* beside = nullptr)
      : simulation(server.load_text(kDeck)),
        stepper(simulation.stepper({kOutput})),
        sharing(simulation.stepper(beside ? *beside : stepper, {kOutput})) {}
  client::Simulation simulation;
  client::Stepper stepper, sharing;
};

struct Options {
  int turns = 20, exchanges = 1000, many = 1000;
  std::string json;
};

struct Place {
  std::string name, address;
  static Place of(const std::string& name, const std::string& transport, int number) {
    const std::string process = std::to_string(::getpid());
    if (transport == "unix")
      return {name, "unix:" + (std::filesystem::temp_directory_path() /
                               ("remote" + process + "." + std::to_string(number)))
                                  .string()};
    return {name, "127.0.0.1:" + std::to_string(20000 + 8 * (::getpid() % 4000) + number)};
  }
};

client::Server connect(const std::string& address) {
  constexpr int kAttempts = 200;
  for (int k = 0;; ++k) {
    try {
      return client::Server::connect(address);
    } catch (const client::Error&) {
      if (k == kAttempts) throw;
      ::usleep(50000);
    }
  }
}

// ------------------------------------------------------------------ the table

class Table {
 public:
  void add(const Lane& lane, const std::map<std::string, double>& more = {}) {
    std::map<std::string, double> row = lane.figures();
    std::printf("%-22s %9.1f %9.1f %9.1f %9.1f %9.1f", lane.name().c_str(), row["median"],
                row["lowest"], row["p99"], row["client"], row["server"]);
    for (const auto& [name, value] : more) std::printf("  %s %.2f", name.c_str(), value);
    std::printf("\n");
    row.insert(more.begin(), more.end());
    rows_.emplace_back(lane.name(), std::move(row));
  }
  void write(const std::string& path) const {
    std::ofstream out(path);
    out << "{";
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      out << (k == 0 ? "" : ",\n ") << '"' << rows_[k].first << "\": {";
      const char* comma = "";
      for (const auto& [name, value] : rows_[k].second) {
        out << comma << '"' << name << "\": " << value;
        comma = ", ";
      }
      out << "}";
    }
    out << "}\n";
  }

 private:
  std::vector<std::pair<std::string, std::map<std::string, double>>> rows_;
};

int run(const Options& options) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");
  const std::string folder = std::filesystem::path(self).parent_path();
  const std::vector<std::string> transports = {"unix", "tcp"},
                                 kinds = {"queue", "callback", "sync"};
  std::vector<std::string> listen = {"--insecure",
                                     "--log-level",
                                     "warn",
                                     "--limit-sessions",
                                     std::to_string(options.many + 8),
                                     "--limit-identity-streams",
                                     std::to_string(options.many + 8)};
  for (const std::string& transport : transports) {
    listen.emplace_back("--listen");
    listen.push_back(Place::of("", transport, 0).address);
  }
  const Process daemon(folder + "/mbcosimd", listen);
  std::vector<std::unique_ptr<Process>> echoes;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    std::vector<std::string> arguments = {"--echo", kinds[k]};
    for (const std::string& transport : transports)
      arguments.push_back(Place::of("", transport, static_cast<int>(k) + 1).address);
    echoes.push_back(std::make_unique<Process>(self, arguments));
  }

  const mbcosim::LoadReport report = mbcosim::load_deck(
      mbcosim::BundleSource(std::map<std::string, std::string>{{"body.mbd", kDeck}}), "body.mbd");
  auto local = mbcosim::Simulation::create(report.model);
  Lane engine(
      "engine", [&] { (void)(*local)->step(); }, nullptr);

  std::vector<std::unique_ptr<EchoStream>> streams;
  std::vector<std::unique_ptr<Stepped>> stepped;
  std::vector<client::Server> servers;
  std::vector<Lane> steps, echo_lanes;  // of each transport one; of each transport all kinds
  for (const std::string& transport : transports) {
    servers.push_back(connect(Place::of("", transport, 0).address));
    stepped.push_back(std::make_unique<Stepped>(servers.back()));
    steps.emplace_back(
        "step, " + transport, [one = stepped.back().get()] { one->stepper.step(); }, &daemon);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      streams.push_back(
          std::make_unique<EchoStream>(Place::of("", transport, static_cast<int>(k) + 1).address));
      echo_lanes.emplace_back(
          "echo, " + kinds[k] + ", " + transport, [one = streams.back().get()] { one->exchange(); },
          echoes[k].get());
    }
  }
  for (int turn = 0; turn < options.turns; ++turn) {
    engine.take_turn(options.exchanges);
    for (std::size_t t = 0; t < transports.size(); ++t) {
      echo_lanes[t * kinds.size()].take_turn(options.exchanges);
      steps[t].take_turn(options.exchanges);
      for (std::size_t k = 1; k < kinds.size(); ++k)
        echo_lanes[t * kinds.size() + k].take_turn(options.exchanges);
    }
  }

  std::vector<std::unique_ptr<Stepped>> many;
  for (int k = 0; k < options.many; ++k)
    many.push_back(std::make_unique<Stepped>(servers[0], &stepped[0]->stepper));
  const auto channel =
      grpc::CreateChannel(Place::of("", "unix", 1).address, grpc::InsecureChannelCredentials());
  std::vector<std::unique_ptr<EchoStream>> many_echoes;
  for (int k = 0; k < options.many; ++k)
    many_echoes.push_back(std::make_unique<EchoStream>(channel));
  std::size_t next = 0, next_stream = 0, next_echo = 0;
  const std::string count = std::to_string(options.many);
  Lane alone(
      "one alone", [&] { stepped[0]->stepper.step(); }, &daemon);
  std::vector<std::unique_ptr<mbcosim::Simulation>> locals;
  for (int k = 0; k < options.many; ++k)
    locals.push_back(std::move(*mbcosim::Simulation::create(report.model)));
  std::size_t next_local = 0;
  Lane engines(
      count + " engines in turn", [&] { (void)locals[next_local++ % locals.size()]->step(); },
      nullptr);
  Lane in_turn(
      count + " in turn", [&] { many[next++ % many.size()]->sharing.step(); }, &daemon);
  Lane streams_in_turn(
      count + " streams in turn", [&] { many[next_stream++ % many.size()]->stepper.step(); },
      &daemon);
  Lane echo_alone(
      "echo alone", [&] { streams[0]->exchange(); }, echoes[0].get());
  Lane echo_in_turn(
      count + " echoes in turn", [&] { many_echoes[next_echo++ % many.size()]->exchange(); },
      echoes[0].get());
  for (int turn = 0; turn < options.turns && !many.empty(); ++turn)
    for (Lane* lane : {&alone, &engines, &in_turn, &streams_in_turn, &echo_alone, &echo_in_turn})
      lane->take_turn(options.exchanges);

  std::printf("%-22s %9s %9s %9s %9s %9s\n", "[us]", "median", "lowest", "p99", "client", "server");
  Table table;
  table.add(engine);
  for (std::size_t t = 0; t < transports.size(); ++t) {
    for (std::size_t k = 0; k < kinds.size(); ++k) table.add(echo_lanes[t * kinds.size() + k]);
    const Lane& echo = echo_lanes[t * kinds.size()];
    table.add(steps[t], {{"ratio", ratio(steps[t].medians(), engine.medians(), echo.medians())},
                         {"ratio_p99", ratio(steps[t].tails(), engine.tails(), echo.tails())}});
  }
  if (!many.empty()) {
    table.add(alone);
    table.add(engines);
    table.add(in_turn, {{"ratio", ratio(in_turn.medians(), {}, alone.medians())}});
    table.add(streams_in_turn, {{"ratio", ratio(streams_in_turn.medians(), {}, alone.medians())}});
    table.add(echo_alone);
    table.add(echo_in_turn, {{"ratio", ratio(echo_in_turn.medians(), {}, echo_alone.medians())}});
  }
  if (!options.json.empty()) table.write(options.json);
  return 0;
}

int usage() {
  std::fprintf(stderr, "usage: remote_step [--turns N] [--exchanges N] [--many N] [--json FILE]\n");
  return 4;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() > 2 && words[0] == "--echo")
    return serve_echo(words[1], {words.begin() + 2, words.end()});
  Options options;
  const std::map<std::string, int*> numbers = {
      {"--turns", &options.turns}, {"--exchanges", &options.exchanges}, {"--many", &options.many}};
  for (std::size_t k = 0; k < words.size(); k += 2) {
    if (k + 1 == words.size()) return usage();
    const auto number = numbers.find(words[k]);
    if (number != numbers.end())
      *number->second = std::atoi(words[k + 1].c_str());
    else if (words[k] == "--json")
      options.json = words[k + 1];
    else
      return usage();
  }
  try {
    return run(options);
  } catch (const client::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 4;
  }
}
