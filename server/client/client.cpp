#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/create_channel.h>

#include <chrono>
#include <filesystem>

#include "client/address.h"
#include "client/bundle.h"
#include "client/convert.h"
#include "client/simulation.h"
#include "client/step_lines.h"
#include "host/addresses.h"

namespace mbcosim::client {
namespace {

constexpr std::size_t kChunkBytes = 1 << 20;

[[noreturn]] void refuse(const char* why, const char* field) {
  throw Error(why, static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "BAD_ARGUMENT", {}, field);
}

std::shared_ptr<grpc::ChannelCredentials> channel_credentials(const Credentials& credentials) {
  if (credentials.certificate.empty() != credentials.key.empty())
    refuse("a certificate and its key belong together", "certificate");
  if (!credentials.tls && credentials.server_ca.empty() && credentials.certificate.empty())
    return grpc::InsecureChannelCredentials();
  return grpc::SslCredentials({credentials.server_ca, credentials.key, credentials.certificate});
}

/// A server that is stopped or behind a black hole is noticed within 20 s.
grpc::ChannelArguments channel_arguments(const std::string& address) {
  grpc::ChannelArguments arguments;
  // No proxy of the environment ($http_proxy) can stand between this machine and itself.
  if (server::is_loopback(address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 200);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  arguments.SetMaxReceiveMessageSize(-1);
  return arguments;
}

/// The bytes of a message's first field, which is a text or a message.
std::string first_text(const std::string& bytes) {
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                            static_cast<int>(bytes.size()));
  constexpr std::uint32_t kFieldOne = 1 << 3 | 2;
  std::uint32_t size = 0;
  std::string text;
  if (in.ReadTag() != kFieldOne || !in.ReadVarint32(&size) ||
      !in.ReadString(&text, static_cast<int>(size)))
    return "";
  return text;
}

/// The field of a `google.rpc.BadRequest`: the first text of its first message.
std::string field_of(const std::string& bytes) { return first_text(first_text(bytes)); }

std::string text_of(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const Diagnostic& d : diagnostics) {
    text += "\n" + d.file;
    if (d.line > 0) text += ":" + std::to_string(d.line) + ":" + std::to_string(d.column);
    text += ": " + d.message;
  }
  return text;
}

}  // namespace

void require(const grpc::Status& status) {
  if (status.ok()) return;
  v1::ErrorStatus details;
  details.ParseFromString(status.error_details());
  v1::ErrorInfo info;
  std::string field;
  std::vector<Diagnostic> diagnostics;
  for (const google::protobuf::Any& detail : details.details()) {
    v1::DeckDiagnostics deck;
    if (detail.UnpackTo(&deck)) diagnostics = to_diagnostics(deck.diagnostics());
    if (detail.type_url().find("google.rpc.ErrorInfo") != std::string::npos)
      info.ParseFromString(detail.value());
    if (detail.type_url().find("google.rpc.BadRequest") != std::string::npos)
      field = field_of(detail.value());
  }
  throw Error(status.error_message() + text_of(diagnostics), static_cast<int>(status.error_code()),
              info.reason(), {info.metadata().begin(), info.metadata().end()}, field,
              std::move(diagnostics));
}

void throw_late(const std::string& what, double seconds) {
  throw Error(what + " took longer than " + std::to_string(seconds) + " s",
              static_cast<int>(grpc::StatusCode::DEADLINE_EXCEEDED), "", {});
}

double checked_timeout(double seconds) {
  constexpr double kLongest = 1e9;
  if (seconds == kEndless || (seconds > 0 && seconds <= kLongest)) return seconds;
  throw Error("`timeout` must be kEndless or a positive number of seconds, at most 1e9, got " +
                  std::to_string(seconds),
              static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "BAD_ARGUMENT", {}, "timeout");
}

// ------------------------------------------------------------------ Server

Server::Impl::~Impl() = default;
Server::Server(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

namespace {

/// What kept gRPC from a connection: nobody listens, a certificate that is not trusted.
std::string last_cause(const Server::Impl& server) {
  constexpr double kAtOnce = 0.1;  // [s]; that it failed is known
  CallContext context(server, kAtOnce);
  v1::GetServerInfoReply reply;
  return server.simulations->GetServerInfo(&context, {}, &reply).error_message();
}

}  // namespace

Server Server::connect(const std::string& address, double timeout, const Credentials& credentials,
                       double reconnect) {
  if (!(reconnect >= 0 && reconnect <= 1e9))
    throw Error(
        "`reconnect` must be a number of seconds from 0 to 1e9, got " + std::to_string(reconnect),
        static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "BAD_ARGUMENT", {}, "reconnect");
  check_address(address);
  if (!server::is_metadata(credentials.token))
    throw Error("the token has characters other than printable ASCII",
                static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "BAD_ARGUMENT", {}, "token");
  auto impl = std::make_shared<Impl>();
  impl->address = address;
  impl->reconnect = reconnect;
  if (!credentials.token.empty()) impl->authorization = "Bearer " + credentials.token;
  impl->channel =
      grpc::CreateCustomChannel(server::channel_target(address), channel_credentials(credentials),
                                channel_arguments(address));
  impl->simulations = v1::Simulations::NewStub(impl->channel);
  impl->coupling = v1::Coupling::NewStub(impl->channel);
  impl->step_lines = std::make_unique<StepLines>(*impl);
  const auto deadline =
      std::chrono::system_clock::now() +
      std::chrono::milliseconds(static_cast<std::int64_t>(checked_timeout(timeout) * 1000));
  if (!impl->channel->WaitForConnected(deadline)) {
    const std::string cause = why_nobody(address);
    throw Error(
        "no server answers at " + address + ": " + (cause.empty() ? last_cause(*impl) : cause),
        static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
  }
  return Server(std::move(impl));
}

std::string Server::version(double timeout) const {
  v1::GetServerInfoReply info;
  repeated(*impl_, timeout, "", [&](CallContext& context) {
    return impl_->simulations->GetServerInfo(&context, {}, &info);
  });
  return info.version();
}

std::vector<SimulationInfo> Server::list(double timeout) const {
  std::vector<SimulationInfo> all;
  v1::ListSimulationsRequest request;
  v1::ListSimulationsReply reply;
  do {
    repeated(*impl_, timeout, "", [&](CallContext& context) {
      return impl_->simulations->ListSimulations(&context, request, &reply);
    });
    for (const v1::SimulationInfo& info : reply.simulations()) all.push_back(to_info(info));
    request.set_page_token(reply.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

Simulation Server::load(const std::string& path, const LoadOptions& options) {
  const std::filesystem::path deck(path);
  const std::string main = deck.filename().string();
  return load_bundle(main, collect_bundle(deck.parent_path().string(), main), options);
}

Simulation Server::load_text(const std::string& deck, const LoadOptions& options) {
  return load_bundle("deck", {{"deck", deck}}, options);
}

namespace {

/// Header and files, as long as the server takes them.
template <class Upload>
grpc::Status send(Upload& upload, const v1::UploadHeader& header,
                  const std::map<std::string, std::string>& files) {
  v1::UploadRequest message;
  *message.mutable_header() = header;
  bool open = upload.Write(message);
  for (const auto& [name, bytes] : files) {
    for (std::size_t at = 0; open && (at == 0 || at < bytes.size()); at += kChunkBytes) {
      message.mutable_chunk()->set_path(name);
      message.mutable_chunk()->set_data(bytes.substr(at, kChunkBytes));
      open = upload.Write(message);
    }
  }
  upload.WritesDone();
  return upload.Finish();
}

Simulation create(const std::shared_ptr<Server::Impl>& server, v1::UploadHeader header,
                  const std::map<std::string, std::string>& files, const LoadOptions& options) {
  v1::CreateSimulationReply reply;
  fill(options, header.mutable_options());
  repeated(*server, options.timeout, "", [&](CallContext& context) {
    return send(*server->simulations->CreateSimulation(&context, &reply), header, files);
  });
  return Simulation::Impl::make(server, reply.simulation(), /*owned=*/true,
                                to_diagnostics(reply.diagnostics()));
}

}  // namespace

Simulation Server::load_bundle(const std::string& main,
                               const std::map<std::string, std::string>& files,
                               const LoadOptions& options) {
  v1::UploadHeader header;
  header.set_bundle_main_file(main);
  return create(impl_, std::move(header), files, options);
}

Simulation Server::load_from_root(const std::string& deck, const LoadOptions& options) {
  v1::UploadHeader header;
  header.set_model_root_file(deck);
  return create(impl_, std::move(header), {}, options);
}

std::vector<Diagnostic> Server::validate(const std::string& path, double timeout) {
  const std::filesystem::path deck(path);
  const std::string main = deck.filename().string();
  const auto files = collect_bundle(deck.parent_path().string(), main);
  v1::ValidateModelReply reply;
  v1::UploadHeader header;
  header.set_bundle_main_file(main);
  repeated(*impl_, timeout, "", [&](CallContext& context) {
    return send(*impl_->simulations->ValidateModel(&context, &reply), header, files);
  });
  return to_diagnostics(reply.diagnostics());
}

Simulation Server::find(const std::string& name, double timeout) {
  v1::GetSimulationRequest request;
  request.set_simulation(name);
  v1::GetSimulationReply reply;
  repeated(*impl_, timeout, name, [&](CallContext& context) {
    return impl_->simulations->GetSimulation(&context, request, &reply);
  });
  return Simulation::Impl::make(impl_, reply.simulation(), /*owned=*/false, {});
}

}  // namespace mbcosim::client
