#include "daemon/daemon.h"

#include <grpc/grpc.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <future>
#include <latch>
#include <limits>
#include <system_error>
#include <thread>
#include <vector>

#include "daemon/tls.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "host/addresses.h"
#include "host/control_group.h"
#include "rpc/reflection.h"
#include "service/coupling_service.h"
#include "service/events_service.h"
#include "service/geometry_service.h"
#include "service/reduction_service.h"
#include "service/results_service.h"
#include "service/simulations_service.h"
#include "service/telemetry_service.h"
#include "threads/top_frame.h"

namespace mbcosim::server {
namespace {

bool is_unix(const std::string& address) { return address.compare(0, kUnix.size(), kUnix) == 0; }

/// Connections with TLS of one source, so that they take an eighth of the memory.
std::int64_t most_handshakes(const MemoryBudget& memory) {
  constexpr std::int64_t kOfOne = 80 << 10;  // bytes, as measured
  return std::max<std::int64_t>(64, memory.most() / 8 / kOfOne);
}

/// As many descriptors as the system grants.
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

void add_channel_arguments(grpc::ServerBuilder& builder, const ServiceLimits& limits) {
  builder.SetMaxReceiveMessageSize(limits.message_bytes);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A client whose host vanished is noticed within half a minute; a slow step is not a dead peer.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5000);
  // A connection that does not come to its point ends; what it may carry is refused by name before
  // this bound, which holds for Unix sockets, too, where connections cannot be told apart.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10000);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, limits.connection_calls + 32);
}

/// What gRPC keeps of messages that have not come whole: they are counted only when they have, and
/// a thousand of them may be under way over one connection. Beyond this it breaks streams off,
/// anybody's: the last resort before the system ends the daemon.
void bound_messages(grpc::ServerBuilder& builder, const ServiceLimits& limits) {
  constexpr std::int64_t kPart = 2, kMessages = 4;
  const std::int64_t least = kMessages * limits.message_bytes;
  grpc::ResourceQuota quota("messages");
  quota.Resize(static_cast<std::size_t>(std::max(limits.memory_bytes / kPart, least)));
  builder.SetResourceQuota(quota);
}

int worker_count(int wanted) { return wanted > 0 ? wanted : usable_cores(); }

/// As many as a busy server needs: half of the cores leave the others to what is computed.
int most_pollers() {
  constexpr int kLeast = 2, kMost = 16;
  return std::clamp(worker_count(0) / 2, kLeast, kMost);
}

/// gRPC would wait without end for threads of its own that it could not start.
void check_threads() {
  const std::size_t needed = 25 + static_cast<std::size_t>(most_pollers() + Pollers::kSpare);
  std::latch end(1);
  std::vector<std::jthread> threads;  // destroyed first: each has been let go by then
  try {
    while (threads.size() < needed) threads.emplace_back([&end] { end.wait(); });
  } catch (const std::exception&) {  // the number tells
  }
  end.count_down();
  if (threads.size() < needed)
    throw std::runtime_error(
        "the system grants the server too few threads (ulimit -u, a container's limit of "
        "processes, systemd's TasksMax): to start it needs " +
        std::to_string(needed - threads.size()) + " more");
}

/// Of "NAME=ROLE", by identity. Names may have `=` in them.
std::map<std::string, Role> certificate_roles(const std::vector<std::string>& given) {
  std::map<std::string, Role> roles;
  for (const std::string& text : given) {
    const auto equals = text.rfind('=');
    const auto role =
        equals == std::string::npos ? std::nullopt : role_named(text.substr(equals + 1));
    if (!role || equals == 0)
      throw std::runtime_error("--certificate-role \"" + text +
                               "\": expected NAME=ROLE, ROLE being observe, control or admin");
    if (!roles.emplace("cert:" + text.substr(0, equals), *role).second)
      throw std::runtime_error("--certificate-role: \"" + text.substr(0, equals) +
                               "\" has more than one role");
  }
  return roles;
}

Authenticator make_authenticator(const Config& config) {
  Authenticator authenticator =
      config.tokens_file.empty() ? Authenticator() : Authenticator::from_file(config.tokens_file);
  authenticator.set_certificate_roles(certificate_roles(config.certificate_roles));
  return authenticator;
}

/// Throws when options contradict each other, or there are too few threads. Fills in the share that
/// one identity gets of what there is: half, where there are several.
Config checked(Config config) {
  check_threads();
  const bool tls = !config.tls_certificate.empty();
  if (tls == config.tls_key.empty())
    throw std::runtime_error("--tls-certificate and --tls-key belong together");
  if (!config.tls_client_ca.empty() && !tls)
    throw std::runtime_error(
        "--tls-client-ca needs --tls-certificate and --tls-key: without TLS no "
        "certificate is ever asked for");
  if (config.resume == "eager" && config.state_dir.empty())
    throw std::runtime_error("--resume eager needs --state-dir");
  if (!config.certificate_roles.empty() &&
      (config.tls_client_ca.empty() || !config.tokens_file.empty()))
    throw std::runtime_error(
        "--certificate-role needs --tls-client-ca, and no --tokens, which tell the roles");
  int& own = config.limits.identity_sessions;
  if (config.limits.memory_bytes == 0) config.limits.memory_bytes = MemoryBudget::default_bytes();
  const bool several = !config.tokens_file.empty() || !config.tls_client_ca.empty();
  std::int64_t& part = config.limits.identity_memory_bytes;
  if (part == 0) part = several ? config.limits.memory_bytes / 2 : config.limits.memory_bytes;
  if (own == 0) own = several ? std::max(1, config.limits.sessions / 2) : config.limits.sessions;
  return config;
}

}  // namespace

Daemon::Daemon(const Config& config)
    : config_(checked(config)),
      authenticator_(make_authenticator(config)),
      tokens_watch_(config.tokens_file),
      slots_(worker_count(config.workers)),
      workers_(config.limits.sessions, worker_count(config.workers)),
      admission_({config.limits.open_calls, config.limits.identity_calls,
                  config.limits.identity_streams, config.limits.connection_calls}),
      budgets_(config_.limits.memory_bytes, config_.limits.identity_memory_bytes),
      runtime_{
          workers_.lanes,
          workers_.timer,
          admission_,
          budgets_,
          authenticator_,
          [this](const std::string& method, const std::string& identity, const Refusal& refusal) {
            log_.refused(method, identity, refusal);
            metrics_.count_failure(refusal.reason());
          }},
      results_(config_.results_root, config_.limits.results_root_bytes),
      deck_sockets_(config_.deck_sockets, config_.limits.deck_sockets, config_.listen),
      durability_(config_, log_, metrics_),
      store_(config_.limits, log_),
      gate_(runtime_),
      health_({"mbcosim.v1.Simulations", "mbcosim.v1.Coupling", "mbcosim.v1.Telemetry",
               "mbcosim.v1.Geometry", "mbcosim.v1.Reduction", "mbcosim.v1.Results",
               "mbcosim.v1.Events"}),
      parts_{config_,  store_, slots_,   metrics_,    log_,
             runtime_, gate_,  results_, durability_, deck_sockets_} {
  add_methods();
  watch_values();
  durability_.start(parts_);
  try {
    listen();
    if (config_.resume == "eager") eager_resume_.start(parts_);
  } catch (...) {
    if (server_) shut_down();
    throw;
  }
}

namespace {

const char* name_of(v1::SimulationState state) {
  switch (state) {
    case v1::SIMULATION_STATE_STEPPING:
      return "stepping";
    case v1::SIMULATION_STATE_FINISHED:
      return "finished";
    case v1::SIMULATION_STATE_FAILED:
      return "failed";
    default:
      return "ready";
  }
}

Metrics::Values count_by_state(const SessionStore& store) {
  Metrics::Values counts{{"ready", 0}, {"stepping", 0}, {"finished", 0}, {"failed", 0}};
  for (const SessionPtr& session : store.all()) ++counts[name_of(session->phase())];
  return counts;
}

}  // namespace

void Daemon::watch_values() {
  const auto watch = [this](const char* name, const char* help, auto value) {
    metrics_.watch(name, help, [value] { return static_cast<double>(value()); });
  };
  watch("mbcosim_open_calls", "Calls and streams at once", [this] { return admission_.open(); });
  watch("mbcosim_memory_bytes", "Memory that is counted against --limit-memory",
        [this] { return budgets_.all().used(); });
  watch("mbcosim_memory_limit_bytes", "--limit-memory", [this] { return budgets_.all().most(); });
  metrics_.watch("mbcosim_simulations", "Simulations in memory, by state", "state",
                 [this] { return count_by_state(store_); });
  watch("mbcosim_simulations_suspended", "Simulations that are in the state folder only",
        [this] { return durability_.suspended(); });
  watch("mbcosim_state_bytes", "Bytes of all that is in the state folder",
        [this] { return durability_.bytes(); });
  watch("process_resident_memory_bytes", "Resident memory", resident_bytes);
  workers_.lanes.set_on_start(
      [this](Lane lane, double seconds) { metrics_.count_queue_wait(lane, seconds); });
}

void Daemon::expose_metrics() {
  if (config_.metrics.empty()) return;
  if (!is_loopback(config_.metrics) && !config_.insecure)
    throw std::runtime_error("refused to serve metrics on " + config_.metrics +
                             ": they are told to anybody; an address other than loopback needs "
                             "--insecure");
  try {
    metrics_.expose(config_.metrics);
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot serve metrics on " + config_.metrics +
                             ", which must be HOST:PORT: " + error.what());
  }
}

void Daemon::add_methods() {
  add_simulations(gate_, parts_);
  add_telemetry(gate_, parts_);
  add_geometry(gate_, parts_);
  add_coupling(gate_, parts_);
  add_reduction(gate_, parts_);
  add_results(gate_, parts_);
  add_events(gate_, parts_);
  health_.add_to(gate_, !config_.health_credentials);
  gate_.add(BacklogWatch::kMethod, BacklogWatch::method());
  if (config_.reflection) add_reflection(gate_);
}

void Daemon::listen() {
  raise_descriptor_limit();
  grpc_init();  // the daemon's share, see `let_go_of_grpc`
  grpc::EnableDefaultHealthCheckService(false);
  grpc::ServerBuilder builder;
  add_channel_arguments(builder, config_.limits);
  bound_messages(builder, config_.limits);
  for (const std::string& address : config_.listen) check_listener(address);
  if (!config_.tls_certificate.empty()) certificate_.emplace(config_);
  std::vector<std::unique_ptr<Listener::Acceptor>> acceptors;
  for (const std::string& address : config_.listen) {
    listeners_.push_back(std::make_unique<Listener>(
        address,
        ConnectionCounts{[this] { metrics_.count_dropped_connection(); },
                         [this] { metrics_.count_broken_off_connection(); }},
        certificate_ && !is_unix(address) ? most_handshakes(budgets_.all())
                                          : std::numeric_limits<std::int64_t>::max()));
    acceptors.push_back(builder.experimental().AddExternalConnectionAcceptor(
        grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
        credentials_for(address)));
  }
  builder.RegisterAsyncGenericService(&gate_.service());
  pollers_.emplace(builder.AddCompletionQueue(), most_pollers());  // there before the server is
  expose_metrics();
  server_ = builder.BuildAndStart();
  if (!server_) throw std::runtime_error("the server cannot start");
  gate_.open(pollers_->queue());
  watch_backlog();
  // Nobody is served before all is open that may fail to.
  if (config_.shared_memory) open_shared_memory();
  if (!config_.http.empty()) open_http();
  for (std::size_t i = 0; i < listeners_.size(); ++i) {
    listeners_[i]->start(std::move(acceptors[i]));
    spdlog::info("listening on {}", listeners_[i]->bound());
  }
  for (const auto& each : shared_memory_)
    spdlog::info("shared memory for peers through {}", each->path());
  if (door_) tell_page();
}

void Daemon::watch_backlog() {
  constexpr int kRefused = 1024;  // may be under way at once
  backlog_.emplace(
      gate_, budgets_.all(), static_cast<std::size_t>(config_.limits.open_calls) + kRefused,
      [this] { return server_->InProcessChannel({}); },
      [this](const std::string& peer) {
        for (const auto& listener : listeners_) listener->break_off(peer);
      });
}

void Daemon::open_shared_memory() {
  for (const std::string& address : config_.listen) {
    const std::string path = shm::rendezvous_path(address);
    if (path.empty()) continue;
    if (path.size() >= sizeof sockaddr_un::sun_path) {
      spdlog::warn("no shared memory beside {}: the path of its socket would be too long", address);
      continue;
    }
    shared_memory_.push_back(std::make_unique<SharedMemoryService>(path, parts_));
  }
}

void Daemon::open_http() {
  http::DoorOptions options;
  options.address = config_.http;
  options.insecure = config_.insecure;
  options.origins = config_.http_origins;
  options.connections = config_.limits.http_connections;
  options.streams_per_identity = config_.limits.http_streams;
  options.message_bytes = static_cast<std::size_t>(config_.limits.message_bytes);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);  // replies of this very process
  door_ = std::make_unique<http::Door>(
      options, http::DoorParts{server_->InProcessChannel(arguments), authenticator_, budgets_,
                               [this] { return metrics_.text(); },
                               [this] { return !draining_.load() && !gate_.closing(); }});
}

void Daemon::tell_page() const {
  spdlog::info("serving HTTP on {}", door_->address());
  std::printf("page: %s\n", door_->page_address().c_str());  // not logged: it holds a secret
  std::fflush(stdout);
}

Daemon::~Daemon() {
  if (server_) shut_down();
  workers_.lanes.stop(std::chrono::hours(1));  // jobs use what is destroyed next
}

void Daemon::check_listener(const std::string& address) const {
  if (is_unix(address) || config_.insecure) return;
  const bool tls = !config_.tls_certificate.empty();
  const bool identified = !config_.tls_client_ca.empty() || !config_.tokens_file.empty();
  if (!identified)
    throw std::runtime_error("refused to listen on " + address +
                             ": every account that reaches a TCP address would be admin; it needs "
                             "--tokens or --tls-client-ca, or --insecure");
  if (!tls && !is_loopback(address))
    throw std::runtime_error("refused to listen on " + address +
                             ": an address other than loopback also needs --tls-certificate and "
                             "--tls-key, or --insecure");
}

std::shared_ptr<grpc::ServerCredentials> Daemon::credentials_for(const std::string& address) const {
  if (is_unix(address) || config_.tls_certificate.empty()) return grpc::InsecureServerCredentials();
  return certificate_->credentials();
}

void Daemon::reload(bool asked) {
  const auto attempt = [](const char* what, const std::function<bool()>& take) {
    try {
      if (take()) spdlog::info("{} read anew", what);
    } catch (const std::exception& error) {
      spdlog::error("{}; what was there before stays in force", error.what());
    }
  };
  attempt("the tokens were", [&] {
    if (config_.tokens_file.empty() || (!tokens_watch_.has_changed() && !asked)) return false;
    authenticator_.reload(config_.tokens_file);
    return true;
  });
  attempt("the certificates were", [&] { return certificate_ && certificate_->reload(asked); });
}

bool Daemon::drain() {
  if (config_.drain.count() == 0) return false;
  spdlog::info("draining for {} s", config_.drain.count());
  draining_.store(true);
  health_.stop();
  return true;
}

namespace {

/// Gives the daemon's share of gRPC back, the last one. gRPC then joins its threads, of which one
/// may look for ten seconds after a client that did not read. False: it takes longer than `wait`,
/// or would, when somebody else's share goes.
bool let_go_of_grpc(std::chrono::seconds wait) {
  const auto done = std::make_shared<std::promise<void>>();
  const std::future<void> end = done->get_future();
  try {
    std::thread([done] {
      grpc_shutdown();
      done->set_value();
    }).detach();
  } catch (const std::system_error&) {  // the system grants no thread for it
    return false;
  }
  if (end.wait_for(wait) != std::future_status::ready) return false;
  if (!grpc_is_initialized()) return true;
  spdlog::debug("gRPC is still in use at the end");  // by itself, after calls that were reset, say
  return false;
}

/// Calls `body` in a thread of its own; where the system grants none, `alone` in this one.
std::thread beside(const char* name, const std::function<void()>& body,
                   const std::function<void()>& alone) {
  try {
    return std::thread([=] { run_caught(name, body); });
  } catch (const std::system_error&) {
    run_caught(name, alone);
    return {};
  }
}

}  // namespace

// gRPC waits for clients to close their connections, for which idle ones take seconds, and closes
// none in the middle of a write: a client that stands still with its socket full would hold it for
// ever.
bool Daemon::end_server() {
  static constexpr std::chrono::milliseconds kLastWords(500);
  constexpr std::chrono::seconds kLastCalls(5);
  std::promise<void> ended;
  const auto cut_off = [this, end = ended.get_future()](std::chrono::seconds grace) {
    if (!gate_.empty_within(grace)) gate_.abandon();
    if (end.wait_for(kLastWords) == std::future_status::ready) return;
    for (const auto& listener : listeners_) listener->cut();
  };
  std::thread cutter = beside(
      "shutdown", [&] { cut_off(config_.shutdown_grace); }, [&] { cut_off({}); });
  server_->Shutdown(std::chrono::system_clock::now() + config_.shutdown_grace + kLastWords);
  ended.set_value();
  if (cutter.joinable()) cutter.join();
  if (!gate_.empty_within(kLastCalls)) return false;  // each needs the server to its end
  listeners_.clear();
  server_.reset();
  pollers_.reset();  // with its share of gRPC: the daemon gives back the last one
  return true;
}

bool Daemon::shut_down() {
  constexpr std::chrono::seconds kLastJobs(1);
  spdlog::info("shutting down");
  health_.stop();
  store_.note_end_of_server();
  backlog_.reset();
  gate_.close();
  eager_resume_.stop();
  for (const auto& listener : listeners_) listener->stop();
  store_.close_all();
  shared_memory_.clear();
  // Its threads look once in a second or two whether they are to end.
  const auto end_door = [this] { door_.reset(); };
  std::thread door_ends = beside("http", end_door, end_door);
  const bool calls_ended = end_server();
  if (door_ends.joinable()) door_ends.join();
  metrics_.close();
  const bool ended = workers_.lanes.stop(kLastJobs) && calls_ended;
  durability_.stop(!ended);
  spdlog::info(ended ? "stopped" : "stopped; work that went on is dropped");
  return ended && let_go_of_grpc(kLastJobs);
}

namespace {

std::shared_ptr<grpc::ChannelCredentials> credentials_of(const HealthCheck& check) {
  if (check.ca.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = read_file(check.ca);
  if (!check.key.empty()) {
    options.pem_private_key = read_file(check.key);
    options.pem_cert_chain = read_file(check.certificate);
  }
  return grpc::SslCredentials(options);
}

grpc::Status ask(const HealthCheck& check, grpc::health::v1::Health::Stub& stub, bool at_once,
                 grpc::health::v1::HealthCheckResponse* response) {
  constexpr std::chrono::milliseconds kAtOnce(100);
  grpc::ClientContext context;
  context.set_wait_for_ready(!at_once);  // a connection that is dropped is tried again
  const std::chrono::milliseconds wait =
      at_once ? kAtOnce : std::chrono::milliseconds(std::chrono::seconds(check.timeout));
  context.set_deadline(std::chrono::system_clock::now() + wait);
  return stub.Check(&context, {}, response);
}

std::string refusal_of(const HealthCheck& check, const grpc::Status& status,
                       const grpc::Status& at_once) {
  if (status.ok()) return "the daemon does not serve: it starts, drains or ends";
  if (status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED)
    return printable(status.error_message());
  const bool has_reason = at_once.error_code() == grpc::StatusCode::UNAVAILABLE;
  return "no answer within " + std::to_string(check.timeout) + " s" +
         (has_reason ? ": " + printable(at_once.error_message()) : "");
}

}  // namespace

int check_health(const HealthCheck& check) {
  grpc::ChannelArguments arguments;
  if (!check.name.empty()) arguments.SetSslTargetNameOverride(check.name);
  if (is_loopback(check.address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto stub = grpc::health::v1::Health::NewStub(
      grpc::CreateCustomChannel(channel_target(check.address), credentials_of(check), arguments));
  grpc::health::v1::HealthCheckResponse response;
  const grpc::Status status = ask(check, *stub, false, &response);
  if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED) return 0;
  const bool serves = response.status() == grpc::health::v1::HealthCheckResponse::SERVING;
  if (status.ok() && (serves || check.alive)) return 0;
  grpc::Status at_once;  // who waits does not hear why a connection cannot be had
  if (!status.ok()) at_once = ask(check, *stub, true, &response);
  std::fprintf(stderr, "mbcosimd: %s: %s\n", check.address.c_str(),
               refusal_of(check, status, at_once).c_str());
  return 1;
}

}  // namespace mbcosim::server
