/// What one exchange costs: an empty echo, a coupled step and a tight iteration over every
/// transport, with 1, 100 and 10 000 doubles each way. Starts `mbcosimd` from its own folder.
///
/// usage: exchange_latency [EXCHANGES]      per line of the table; default 2000
///
/// echo       a message there and one back, nothing else done on either side
/// step       mode LOOSE: time from one exchange to the next, the step's solution in between
/// iteration  mode TIGHT: time from one exchange to the next within a step
/// ratio      (median - solver) / median of the echo over the same transport
#include <grpcpp/grpcpp.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "mbcosim/v1/coupling.grpc.pb.h"
#include "rpc/workers.h"
#include "service/session.h"
#include "shared_memory/channel.h"

namespace {

namespace v1 = mbcosim::v1;
namespace client = mbcosim::client;
namespace shm = mbcosim::shm;
namespace server = mbcosim::server;
using Clock = std::chrono::steady_clock;
using Samples = std::vector<double>;  // [µs]

double microseconds(Clock::duration d) {
  return std::chrono::duration<double, std::micro>(d).count();
}

/// A spinning body, whose steps take a few iterations, and a stream of `numbers` doubles.
std::string deck(int numbers) {
  return "begin: data; problem: initial value; end: data;"
         "begin: initial value; initial time: 0.; final time: forever; time step: 1.e-3; method: "
         "ms, .6;"
         " tolerance: 1.e-9; max iterations: 20; end: initial value;"
         "begin: control data; structural nodes: 1; rigid bodies: 1; file drivers: 1; end: control "
         "data;"
         "begin: nodes; structural: 1, dynamic, null, eye, null, .01, 2., .01; end: nodes;"
         "begin: drivers; file: 1, stream, name, \"wide\", create, yes, " +
         std::to_string(numbers) +
         "; end: drivers;"
         "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;";
}

// ------------------------------------------------------------------ echoes

void fill_answer(const v1::PeerMessage& in, v1::ServerMessage* out) {
  *out->mutable_exchange()->mutable_signals() = in.exchange().answer().signals();
}

class Echo final : public v1::Coupling::Service {
  grpc::Status Attach(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::ServerMessage, v1::PeerMessage>* stream) override {
    v1::PeerMessage in;
    v1::ServerMessage out;
    while (stream->Read(&in)) {
      fill_answer(in, &out);
      stream->Write(out);
    }
    return grpc::Status::OK;
  }
};

std::unique_ptr<grpc::Server> serve_echo(Echo& echo, const std::vector<std::string>& addresses) {
  grpc::ServerBuilder builder;
  for (const std::string& address : addresses)
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
  builder.RegisterService(&echo);
  return builder.BuildAndStart();
}

/// Durations of `exchange()` without the first ones.
template <class Exchange>
Samples sample(int count, Exchange&& exchange) {
  Samples samples;
  for (int k = 0; k < count + count / 10; ++k) {
    const Clock::time_point start = Clock::now();
    exchange();
    if (k >= count / 10) samples.push_back(microseconds(Clock::now() - start));
  }
  return samples;
}

v1::PeerMessage message_of(int numbers) {
  v1::PeerMessage message;
  message.mutable_exchange()->mutable_answer()->mutable_signals()->Resize(numbers, 1.0);
  return message;
}

Samples echo_over(const std::shared_ptr<grpc::Channel>& channel, int numbers, int count) {
  const auto stub = v1::Coupling::NewStub(channel);
  grpc::ClientContext context;
  const auto stream = stub->Attach(&context);
  const v1::PeerMessage out = message_of(numbers);
  v1::ServerMessage in;
  Samples samples = sample(count, [&] {
    stream->Write(out);
    stream->Read(&in);
  });
  stream->WritesDone();
  (void)stream->Finish();
  return samples;
}

constexpr auto kLong = std::chrono::seconds(10);

/// In a process of its own.
void serve_shared_memory_echo(shm::Channel& channel) {
  v1::PeerMessage in;
  v1::ServerMessage out;
  while (channel.receive(&in, Clock::now() + kLong * 60) == shm::Channel::Received::message) {
    fill_answer(in, &out);
    channel.send(out, Clock::now() + kLong);
  }
}

Samples echo_over(shm::Channel& channel, int numbers, int count) {
  const v1::PeerMessage out = message_of(numbers);
  v1::ServerMessage in;
  return sample(count, [&] {
    channel.send(out, Clock::now() + kLong);
    channel.receive(&in, Clock::now() + kLong);
  });
}

// ------------------------------------------------------------------ coupled

/// Times from one exchange to the next.
class Intervals {
 public:
  explicit Intervals(bool within_steps) : within_steps_(within_steps) {}
  void tick(int iteration) {
    const Clock::time_point now = Clock::now();
    const bool counts = ++exchanges_ > 100 && (!within_steps_ || iteration > 1);
    if (counts) samples_.push_back(microseconds(now - last_));
    last_ = now;
  }
  long exchanges() const { return exchanges_; }
  const Samples& samples() const { return samples_; }

 private:
  const bool within_steps_;
  Clock::time_point last_;
  long exchanges_ = 0;
  Samples samples_;
};

struct Coupled {
  Samples intervals;
  double solver = 0;  ///< of one interval [µs]
};

Coupled couple_over(const std::string& address, client::Transport transport, client::Mode mode,
                    int numbers, int count) {
  client::Server daemon = client::Server::connect(address);
  client::LoadOptions load;
  load.ports = {{.name = "loop", .outputs = {"stream.wide"}, .inputs = {"stream.wide"}}};
  client::Simulation simulation = daemon.load_text(deck(numbers), load);
  Intervals intervals(mode == client::Mode::tight);
  client::Loads answer;
  answer.signals.assign(static_cast<std::size_t>(numbers), 1.0);
  client::PeerOptions options;
  options.transport = transport;
  options.mode = mode;
  client::Peer peer = simulation.couple(
      "loop",
      [&](const client::Motion& motion) {
        intervals.tick(motion.iteration);
        return answer;
      },
      options);
  const client::StepResult result = simulation.step(count);
  if (!result.ok()) std::fprintf(stderr, "error: %s\n", result.failure.c_str());
  peer.close();
  return {intervals.samples(), 1e6 * result.solver_seconds / double(intervals.exchanges())};
}

/// A peer in this process: answers within `send`.
class DirectLink : public server::PeerLink {
 public:
  DirectLink(server::Port& port, Intervals& intervals, int numbers)
      : port_(port), intervals_(intervals), answer_(message_of(numbers)) {}
  bool send(const v1::ServerMessage& message, Clock::time_point,
            const mbcosim::CancelToken&) override {
    if (!message.has_exchange()) return true;
    intervals_.tick(message.exchange().iteration());
    answer_.mutable_exchange()->set_index(message.exchange().index());
    port_.deliver(answer_.exchange());
    return true;
  }

 private:
  server::Port& port_;
  Intervals& intervals_;
  v1::PeerMessage answer_;
};

Coupled couple_in_process(v1::CouplingMode mode, int numbers, int count) {
  server::Config config;
  server::Metrics metrics;
  server::EventLog log;
  server::SolverSlots slots(1);
  server::MemoryBudget memory(server::MemoryBudget::default_bytes());
  server::Workers workers(1, 1);
  const mbcosim::LoadReport loaded = mbcosim::load_deck(
      mbcosim::BundleSource(std::map<std::string, std::string>{{"deck", deck(numbers)}}), "deck");
  v1::CreateOptions session_options;
  v1::PortDefinition* definition = session_options.add_ports();
  definition->set_name("loop");
  definition->set_kind(v1::PORT_KIND_SIGNAL);
  definition->add_output_variables("stream.wide");
  definition->add_input_variables("stream.wide");
  auto simulation = mbcosim::Simulation::create(loaded.model);
  server::Session session(
      {}, {}, std::move(*simulation),
      {slots, config.limits, metrics, log, memory, workers.lanes, workers.timer}, session_options);
  server::Port& port = session.port("loop");
  server::Agreement agreement;
  agreement.mode = mode;
  port.reserve(agreement);
  Intervals intervals(mode == v1::COUPLING_MODE_TIGHT);
  DirectLink link(port, intervals, numbers);
  port.attach(&link, {});
  v1::StepRequest request;
  request.set_steps(count);
  v1::StepReply reply;
  server::Call call;
  session.step(request, {"local", server::Role::control}, call, &reply);
  port.detach();
  return {intervals.samples(), 1e6 * reply.solver_seconds() / double(intervals.exchanges())};
}

// ------------------------------------------------------------------ the table

double quantile(Samples samples, double fraction) {
  if (samples.empty()) return NAN;
  const auto at = samples.begin() + std::ptrdiff_t(fraction * double(samples.size() - 1));
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

/// Prints the three lines of one transport and size.
void print(const char* transport, int numbers, const Samples& echo, const Coupled& step,
           const Coupled& iteration) {
  const double base = quantile(echo, 0.5);
  std::printf("%-14s %7d  %-9s %10.2f %10.2f\n", transport, numbers, "echo", base,
              quantile(echo, 0.99));
  for (const auto& [name, run] : {std::pair("step", &step), std::pair("iteration", &iteration)}) {
    const double median = quantile(run->intervals, 0.5);
    std::printf("%-14s %7d  %-9s %10.2f %10.2f %10.2f %10.2f %7.2f\n", transport, numbers, name,
                median, quantile(run->intervals, 0.99), run->solver, median - run->solver,
                (median - run->solver) / base);
  }
  if (std::fflush(stdout) != 0) throw std::runtime_error("nobody reads the table any more");
}

/// Another process; it ends with this object.
class Process {
 public:
  explicit Process(pid_t pid) : pid_(pid) {}
  ~Process() {
    ::kill(pid_, SIGTERM);
    ::waitpid(pid_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

 private:
  pid_t pid_;
};

pid_t start(const std::string& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t pid = 0;
  if (::posix_spawn(&pid, program.c_str(), nullptr, nullptr, argv.data(), environ) == 0) return pid;
  throw std::runtime_error("cannot start " + program);
}

/// A channel to a process that echoes. Called while this process has one thread.
std::unique_ptr<shm::Channel> start_shared_memory_echo(pid_t* pid) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) != 0) std::exit(4);
  constexpr std::size_t kLongest = 1 << 24;
  shm::Segment segment = shm::Segment::create();
  *pid = ::fork();
  const bool child = *pid == 0;
  shm::Descriptor other(ends[child ? 0 : 1]);
  auto channel = std::make_unique<shm::Channel>(
      shm::Descriptor(ends[child ? 1 : 0]), std::move(segment),
      child ? shm::Channel::Side::client : shm::Channel::Side::server, kLongest);
  if (!child) return channel;
  other = shm::Descriptor();
  serve_shared_memory_echo(*channel);
  std::_Exit(0);
}

struct Place {
  std::string daemon, echo;
};

void measure_stream(const char* name, const Place& place, int numbers, int count) {
  const auto channel = grpc::CreateChannel(place.echo, grpc::InsecureChannelCredentials());
  const auto over = [&](client::Mode mode) {
    return couple_over(place.daemon, client::Transport::stream, mode, numbers, count);
  };
  const Samples echo = echo_over(channel, numbers, count);
  print(name, numbers, echo, over(client::Mode::loose), over(client::Mode::tight));
}

int run(int count) {
  std::signal(SIGPIPE, SIG_IGN);  // when nobody reads the table, the other processes must end
  pid_t echo_pid = 0;
  const auto shared_memory = start_shared_memory_echo(&echo_pid);
  const Process echo_process(echo_pid);
  const std::string folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const std::string sockets =
      std::filesystem::temp_directory_path() / ("latency" + std::to_string(::getpid()));
  const int port = 20000 + ::getpid() % 20000;
  const Place unix_socket{"unix:" + sockets + ".d", "unix:" + sockets + ".e"};
  const Place loopback{"127.0.0.1:" + std::to_string(port),
                       "127.0.0.1:" + std::to_string(port + 1)};
  const Process daemon(
      start(folder + "/mbcosimd", {"--listen", unix_socket.daemon, "--insecure", "--listen",
                                   loopback.daemon, "--log-level", "warn"}));
  const Process echo(
      start(folder + "/exchange_latency", {"--echo", unix_socket.echo, loopback.echo}));
  client::Server::connect(unix_socket.daemon, 30);

  Echo in_process;
  const auto in_process_server = serve_echo(in_process, {});
  std::printf("%-14s %7s  %-9s %10s %10s %10s %10s %7s\n", "transport", "doubles", "what",
              "median us", "p99 us", "solver us", "rest us", "ratio");
  for (const int numbers : {1, 100, 10000}) {
    measure_stream("Unix socket", unix_socket, numbers, count);
    measure_stream("loopback TCP", loopback, numbers, count);
    const auto over = [&](client::Mode mode) {
      return couple_over(unix_socket.daemon, client::Transport::shared_memory, mode, numbers,
                         count);
    };
    print("shared memory", numbers, echo_over(*shared_memory, numbers, count),
          over(client::Mode::loose), over(client::Mode::tight));
    print("in process", numbers, echo_over(in_process_server->InProcessChannel({}), numbers, count),
          couple_in_process(v1::COUPLING_MODE_LOOSE, numbers, count),
          couple_in_process(v1::COUPLING_MODE_TIGHT, numbers, count));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (!arguments.empty() && arguments[0] == "--echo") {
    Echo echo;
    serve_echo(echo, {arguments.begin() + 1, arguments.end()})->Wait();
    return 0;
  }
  const int count = arguments.empty() ? 2000 : std::atoi(arguments[0].c_str());
  if (count < 1) {
    std::fprintf(stderr, "usage: exchange_latency [EXCHANGES]\n");
    return 4;
  }
  try {
    return run(count);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 3;
  }
}
