#include "http/door.h"

#include <civetweb.h>
#include <spdlog/spdlog.h>

#include <array>
#include <latch>
#include <stdexcept>

#include "host/addresses.h"
#include "http/admission.h"
#include "http/connection.h"
#include "http/crowd.h"
#include "http/page.h"
#include "http/reaper.h"
#include "http/rpc_error.h"
#include "http/rpc_handler.h"
#include "service/library_log.h"
#include "threads/top_frame.h"
#include "wire/refusal.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kLastWords{500};  // for a reader, once the door closes
constexpr const char* kNoPage =
    "This daemon was built without its page (CMake option MBCOSIM_PAGE, or no npm at build time).\n"
    "Calls, /metrics and /healthz are served all the same.\n";

/// "localhost:80" as the numbers that civetweb wants; a host name is not looked up.
std::string numeric(const std::string& address) {
  const std::size_t colon = std::min(address.rfind(':'), address.size());
  const std::string host = address.substr(0, colon);
  return (host == "localhost" ? "127.0.0.1" : host) + address.substr(colon);
}

/// civetweb's own lines: what clients send that is no request.
int log_message(const mg_connection*, const char* message) {
  static LibraryLog log("http");
  log.tell(spdlog::level::debug, message);
  return 1;
}

}  // namespace

struct Door::Impl {
  Impl(const DoorOptions& options, DoorParts parts);
  ~Impl();

  int serve(mg_connection* raw);
  void route(Connection& connection);
  void serve_page(Connection& connection);
  void serve_call(Connection& connection, const google::protobuf::MethodDescriptor& method);
  static void fail(Connection& connection, v1::Reason reason, const std::string& message,
                   int status = 0, Headers headers = {});
  static Impl& of(const mg_connection* raw);
  static int came(const mg_connection* raw, void** connection_data);
  void began(const mg_connection* raw);
  static void ended(const mg_connection* raw);
  static void went(const mg_connection* raw);

  DoorParts parts;
  Reaper reaper;
  Crowd crowd;
  std::unique_ptr<Admission> admission;
  RpcHandler rpc;
  std::string address, page_address;
  std::latch opened{1};  ///< requests wait until all of the above is there
  mg_context* context = nullptr;
};

Door::Impl::Impl(const DoorOptions& options, DoorParts given)
    : parts(std::move(given)),
      crowd(options.connections),
      rpc(parts.channel, parts.budgets,
          {options.message_bytes, options.streams_per_identity,
           std::max(1, options.connections * 3 / 4), std::max(1, options.connections / 2),
           std::max(1, options.connections * 7 / 8)}) {
  const std::string wanted = numeric(options.address);
  if (!is_loopback(wanted) && !options.insecure)
    throw std::runtime_error("refused to serve HTTP on " + options.address +
                             ": an address other than loopback needs --insecure; put a proxy with "
                             "TLS before the door");
  check_origins(options.origins);
  mg_init_library(MG_FEATURES_DEFAULT);
  const std::string threads = std::to_string(options.connections);
  const std::string transfer_time = std::to_string(kTransferTime.count());
  const std::array<const char*, 19> settings{"listening_ports",
                                             wanted.c_str(),
                                             "num_threads",
                                             threads.c_str(),
                                             "request_timeout_ms",
                                             transfer_time.c_str(),
                                             "keep_alive_timeout_ms",
                                             "2000",
                                             "enable_keep_alive",
                                             "yes",
                                             "connection_queue",
                                             "256",
                                             "tcp_nodelay",
                                             "1",
                                             "linger_timeout_ms",
                                             "1000",
                                             "enable_directory_listing",
                                             "no",
                                             nullptr};
  mg_callbacks callbacks{};
  callbacks.init_connection = came;
  callbacks.begin_request = [](mg_connection* raw) { return of(raw).serve(raw); };
  callbacks.end_request = [](const mg_connection* raw, int) {
    ended(raw);
    auto* peer = static_cast<Peer*>(mg_get_user_connection_data(raw));
    if (peer) peer->look_for_request();
  };
  callbacks.connection_close = went;
  callbacks.http_error = answer_malformed;
  callbacks.log_message = log_message;
  context = mg_start(&callbacks, this, const_cast<const char**>(settings.data()));
  if (!context)
    throw std::runtime_error("cannot serve HTTP on " + options.address + "; is it in use?");
  mg_server_port port{};
  mg_get_server_ports(context, 1, &port);
  const auto host_of = [](const std::string& text) { return text.substr(0, text.rfind(':')); };
  address = host_of(options.address) + ":" + std::to_string(port.port);
  crowd.listens_at({host_of(wanted), port.port});
  admission = std::make_unique<Admission>(parts.authenticator, address, options.origins);
  page_address = "http://" + address + "/";
  if (!admission->startup_token().empty()) page_address += "?token=" + admission->startup_token();
  opened.count_down();
}

Door::Impl::~Impl() {
  rpc.close();
  reaper.hurry(kLastWords);
  crowd.dismiss();
  if (context) mg_stop(context);
  mg_exit_library();
}

Door::Impl& Door::Impl::of(const mg_connection* raw) {
  return *static_cast<Impl*>(mg_get_user_data(mg_get_context(raw)));
}

int Door::Impl::came(const mg_connection* raw, void**) {
  of(raw).crowd.came();
  return 0;
}

void Door::Impl::began(const mg_connection* raw) {
  auto* peer = static_cast<Peer*>(mg_get_user_connection_data(raw));
  peer->for_request.end(Alertness::Clock::now());
  if (!peer->in_request) crowd.began(peer->socket);
  peer->in_request = true;
}

// Once or twice: with the request, and with the connection.
void Door::Impl::ended(const mg_connection* raw) {
  auto* peer = static_cast<Peer*>(mg_get_user_connection_data(raw));
  if (!peer) return;
  of(raw).reaper.disarm(peer->socket);
  if (peer->in_request) of(raw).crowd.ended(peer->socket);
  peer->in_request = false;
}

void Door::Impl::went(const mg_connection* raw) {
  ended(raw);
  delete static_cast<Peer*>(mg_get_user_connection_data(raw));
  of(raw).crowd.went();
}

void Door::Impl::fail(Connection& connection, v1::Reason reason, const std::string& message,
                      int status, Headers headers) {
  const grpc::Status failure = Refusal(reason, message).status();
  if (status == 0) status = http_status(failure.error_code());
  if (status == 401) headers.emplace_back("WWW-Authenticate", "Bearer");
  connection.respond(status, "application/json", connect_error(failure), headers);
}

int Door::Impl::serve(mg_connection* raw) {
  opened.wait();
  if (const char* fault = fault_of(*mg_get_request_info(raw))) {
    answer_malformed(raw, 400, fault);
    return 400;
  }
  int status = 500;
  run_caught("http", [&] {
    Connection connection(raw, reaper, crowd);
    began(raw);
    try {
      route(connection);
    } catch (const Refusal& refusal) {
      fail(connection, refusal.reason(), refusal.what());
    } catch (const std::exception& error) {
      spdlog::error("http {}: {}", printable(std::string(connection.path())), error.what());
      fail(connection, v1::REASON_INTERNAL, "internal error");
    }
    status = connection.status();
  });
  return status;
}

void Door::Impl::route(Connection& connection) {
  const std::string_view path = connection.path();
  const bool reads = connection.method() == "GET" || connection.method() == "HEAD";
  if (reads && path == "/healthz") return connection.respond(200, kPlainText, "ok\n");
  if (reads && path == "/readyz") {
    const bool ready = parts.ready();
    return connection.respond(ready ? 200 : 503, kPlainText, ready ? "ready\n" : "not ready\n");
  }
  const std::string refusal = admission->refuse_site(connection);
  if (!refusal.empty()) return fail(connection, v1::REASON_ROLE_TOO_LOW, refusal);
  if (reads && path == "/") return serve_page(connection);
  const auto* method = RpcHandler::find(path);
  if (!method && path != "/metrics")
    return fail(connection, v1::REASON_NOT_SERVED, "nothing is served under this path", 404);
  if (method ? connection.method() != "POST" : !reads)
    return fail(connection, v1::REASON_NOT_SERVED, method ? "calls are POST" : "use GET", 405,
                {{"Allow", method ? "POST" : "GET, HEAD"}});
  if (method) return serve_call(connection, *method);
  if (!admission->authorize(connection))
    return fail(connection, v1::REASON_UNAUTHENTICATED, "a bearer token is required");
  connection.respond(200, "text/plain; version=0.0.4", parts.metrics());
}

void Door::Impl::serve_page(Connection& connection) {
  if (const auto token = query_value(connection.query(), "token")) {
    if (!admission->accepts(*token))
      return fail(connection, v1::REASON_UNAUTHENTICATED, "the token in the address is wrong");
    return connection.respond(303, kPlainText, "",
                              {{"Location", "./"},  // a proxy may have a prefix before it
                               {"Set-Cookie", admission->cookie_name() + "=" + *token +
                                                  "; Path=/; HttpOnly; SameSite=Strict"}});
  }
  const std::string_view page = page_document();
  if (page.empty()) return connection.respond(404, kPlainText, kNoPage);
  connection.respond(200, "text/html; charset=utf-8", page,
                     {{"Cache-Control", "no-cache"},
                      {"X-Frame-Options", "DENY"},
                      {"Referrer-Policy", "no-referrer"}});
}

void Door::Impl::serve_call(Connection& connection,
                            const google::protobuf::MethodDescriptor& method) {
  const auto authorization = admission->authorize(connection);
  if (!authorization)
    return fail(connection, v1::REASON_UNAUTHENTICATED,
                "a token is required: `Authorization: Bearer TOKEN`, or the page's address as the "
                "daemon printed it, with ?token=YOURS behind it where it has none");
  const Caller caller = parts.authenticator.check_local(*authorization, Role::observe);
  rpc.serve(connection, method, caller.identity, *authorization);
}

Door::Door(const DoorOptions& options, DoorParts parts)
    : impl_(std::make_unique<Impl>(options, std::move(parts))) {}
Door::~Door() = default;
const std::string& Door::page_address() const { return impl_->page_address; }
const std::string& Door::address() const { return impl_->address; }

}  // namespace mbcosim::server::http
