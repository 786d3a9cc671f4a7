#include "daemon/daemon.h"

#include <arpa/inet.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

namespace mbcosim::server {
namespace {

constexpr std::string_view kUnix = "unix:";

bool is_unix(const std::string& address) { return address.compare(0, kUnix.size(), kUnix) == 0; }

bool is_loopback(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  in_addr number{};
  const bool in_loopback_net =
      ::inet_pton(AF_INET, host.c_str(), &number) == 1 && (ntohl(number.s_addr) >> 24) == 127;
  return host == "localhost" || host == "[::1]" || in_loopback_net;
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// A socket file that nobody listens on is stale and may be replaced; gRPC removes it when it binds.
void check_socket(const std::string& path) {
  sockaddr_un name{};
  if (path.size() >= sizeof name.sun_path)
    throw std::runtime_error("the socket's path is too long: " + path);
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0) return;
  if (!S_ISSOCK(info.st_mode)) throw std::runtime_error(path + " exists and is not a socket");
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool alive =
      fd >= 0 && ::connect(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
  if (fd >= 0) ::close(fd);
  if (alive) throw std::runtime_error("another server listens on " + path);
}

void add_channel_arguments(grpc::ServerBuilder& builder, const ServiceLimits& limits) {
  builder.SetMaxReceiveMessageSize(limits.message_bytes);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A client whose host vanished is noticed within half a minute; a slow step is not a dead peer.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5000);
  grpc::ResourceQuota quota("mbcosimd");
  quota.SetMaxThreads(limits.open_calls + 16);
  builder.SetResourceQuota(quota);
}

int worker_count(int wanted) {
  return wanted > 0 ? wanted : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

Authenticator make_authenticator(const std::string& tokens_file) {
  return tokens_file.empty() ? Authenticator() : Authenticator::from_file(tokens_file);
}

}  // namespace

Daemon::Daemon(const Config& config)
    : config_(config),
      authenticator_(make_authenticator(config.tokens_file)),
      slots_(worker_count(config.workers)),
      store_(config_.limits, metrics_),
      parts_{config_, authenticator_, store_, watch_, slots_, metrics_},
      simulations_(parts_),
      telemetry_(parts_),
      coupling_(parts_),
      reduction_(parts_) {
  grpc::EnableDefaultHealthCheckService(true);
  if (config_.reflection) grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  add_channel_arguments(builder, config_.limits);
  std::vector<int> ports(config_.listen.size(), 0);
  for (std::size_t i = 0; i < config_.listen.size(); ++i) {
    check_listener(config_.listen[i]);
    builder.AddListeningPort(config_.listen[i], credentials_for(config_.listen[i]), &ports[i]);
  }
  builder.RegisterService(&simulations_);
  builder.RegisterService(&telemetry_);
  builder.RegisterService(&coupling_);
  builder.RegisterService(&reduction_);
  if (!config_.metrics.empty()) metrics_.expose(config_.metrics);
  const mode_t old_mask = ::umask(0177);  // sockets get mode 0600
  server_ = builder.BuildAndStart();
  ::umask(old_mask);
  if (!server_) throw std::runtime_error("cannot listen on the address; is it in use?");
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const std::string& address = config_.listen[i];
    const std::string bound =
        is_unix(address) ? address
                         : address.substr(0, address.rfind(':') + 1) + std::to_string(ports[i]);
    spdlog::info("listening on {}", bound);
  }
  if (config_.shared_memory) open_shared_memory();
  if (!config_.http.empty()) open_http();
}

void Daemon::open_shared_memory() {
  for (const std::string& address : config_.listen) {
    const std::string path = shm::rendezvous_path(address);
    if (path.empty()) continue;
    if (path.size() >= sizeof sockaddr_un::sun_path) {
      spdlog::warn("no shared memory beside {}: the path of its socket would be too long", address);
      continue;
    }
    shared_memory_.push_back(std::make_unique<SharedMemoryService>(path, parts_, coupling_));
    spdlog::info("shared memory for peers through {}", path);
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
      options,
      http::DoorParts{server_->InProcessChannel(arguments), authenticator_,
                      [this] { return metrics_.text(); }, [this] { return !watch_.closing(); }});
  spdlog::info("serving HTTP on {}", door_->address());
  std::printf("page: %s\n", door_->page_address().c_str());  // not logged: it holds a secret
  std::fflush(stdout);
}

Daemon::~Daemon() {
  if (server_) shut_down();
}

void Daemon::check_listener(const std::string& address) const {
  if (is_unix(address)) {
    check_socket(address.substr(kUnix.size()));
    return;
  }
  if (address.rfind(':') == std::string::npos)
    throw std::runtime_error("listener \"" + address + "\" is neither unix:PATH nor HOST:PORT");
  const bool tls = !config_.tls_certificate.empty();
  const bool identified = !config_.tls_client_ca.empty() || !config_.tokens_file.empty();
  if (is_loopback(address) || config_.insecure || (tls && identified)) return;
  throw std::runtime_error("refused to listen on " + address +
                           ": an address other than loopback needs --tls-certificate and --tls-key "
                           "with --tls-client-ca or "
                           "--tokens, or --insecure");
}

std::shared_ptr<grpc::ServerCredentials> Daemon::credentials_for(const std::string& address) const {
  if (is_unix(address) || config_.tls_certificate.empty()) return grpc::InsecureServerCredentials();
  grpc::SslServerCredentialsOptions options(
      config_.tls_client_ca.empty() ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                                    : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  options.pem_key_cert_pairs.push_back(
      {read_file(config_.tls_key), read_file(config_.tls_certificate)});
  if (!config_.tls_client_ca.empty()) options.pem_root_certs = read_file(config_.tls_client_ca);
  return grpc::SslServerCredentials(options);
}

void Daemon::shut_down() {
  spdlog::info("shutting down");
  if (auto* health = server_->GetHealthCheckService()) health->SetServingStatus(false);
  watch_.cancel_all();
  store_.close_all();
  shared_memory_.clear();
  door_.reset();
  server_->Shutdown(std::chrono::system_clock::now() + config_.shutdown_grace);
  server_.reset();
  spdlog::info("stopped");
}

int check_health(const std::string& address) {
  const auto stub =
      v1::Simulations::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(3));
  v1::ServerInfo info;
  const grpc::Status status = stub->GetServerInfo(&context, {}, &info);
  const bool alive = status.ok() || status.error_code() == grpc::StatusCode::UNAUTHENTICATED;
  return alive ? 0 : 1;
}

}  // namespace mbcosim::server
