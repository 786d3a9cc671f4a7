#include "http/rpc_handler.h"

#include <array>
#include <charconv>

#include "http/rpc_error.h"
#include "wire/convert.h"
#include "wire/memory.h"
#include "wire/metadata.h"
#include "wire/refusal.h"

namespace mbcosim::server::http {
namespace {

using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using Kind = Framing::Kind;

struct ContentType {
  std::string_view name;
  Framing framing;
};

constexpr std::array<ContentType, 9> kContentTypes{{
    {"application/json", {Kind::unary, Encoding::json}},
    {"application/proto", {Kind::unary, Encoding::binary}},
    {"application/connect+json", {Kind::stream, Encoding::json}},
    {"application/connect+proto", {Kind::stream, Encoding::binary}},
    {"application/grpc-web", {Kind::grpc_web, Encoding::binary}},
    {"application/grpc-web+proto", {Kind::grpc_web, Encoding::binary}},
    {"application/grpc-web+json", {Kind::grpc_web, Encoding::json}},
    {"application/grpc-web-text", {Kind::grpc_web_text, Encoding::binary}},
    {"application/grpc-web-text+proto", {Kind::grpc_web_text, Encoding::binary}},
}};

// Besides `authorization`, what the service or a balancer before it reads.
constexpr std::array<const char*, 3> kMetadata{"traceparent", "tracestate", "mbcosim-session"};

constexpr unsigned char kEndOfStream = 2;  // of Connect
constexpr unsigned char kTrailers = 0x80;  // of gRPC-Web

std::unique_ptr<Message> new_message(const google::protobuf::Descriptor* type) {
  return std::unique_ptr<Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
}

std::string transcode(Encoding encoding, const google::protobuf::Descriptor* type,
                      std::string bytes) {
  if (encoding == Encoding::binary) return bytes;
  const auto message = new_message(type);
  if (!message->ParseFromString(bytes)) throw std::runtime_error("a reply cannot be read");
  return encode(encoding, *message);
}

grpc::Status bad_request(const std::string& message) {
  return Refusal(v1::REASON_BAD_ARGUMENT, message).status();
}

grpc::Status not_served(const std::string& message) {
  return Refusal(v1::REASON_NOT_SERVED, message).status();
}

/// One unit of `grpc-timeout` [ms]; 0: there is no such unit.
double milliseconds_in(char unit) {
  switch (unit) {
    case 'H':
      return 3.6e6;
    case 'M':
      return 6e4;
    case 'S':
      return 1e3;
    case 'm':
      return 1;
    case 'u':
      return 1e-3;
    case 'n':
      return 1e-6;
    default:
      return 0;
  }
}

/// `Connect-Timeout-Ms: 250`, of ten digits at most, or `grpc-timeout: 250m`, of eight and a unit,
/// as their protocols say. None: the header is not there, or asks for more than any clock can
/// count. Throws Refusal.
std::optional<std::chrono::milliseconds> timeout_of(const Connection& connection, bool grpc) {
  constexpr double kLongest = 3.6e6 * 24 * 36525;  // [ms], a hundred years
  const std::string name = grpc ? "grpc-timeout" : "Connect-Timeout-Ms";
  if (!connection.has_header(name.c_str())) return std::nullopt;
  const std::string_view text = connection.header(name.c_str());
  const std::string_view digits = text.substr(0, text.find_first_not_of("0123456789"));
  const std::string_view unit = text.substr(digits.size());
  const double scale = grpc ? (unit.size() == 1 ? milliseconds_in(unit[0]) : 0) : unit.empty();
  if (digits.empty() || digits.size() > (grpc ? 8 : 10) || scale == 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "the header " + name + " is no time: \"" + utf8(std::string(text)) + '"');
  std::int64_t count = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), count);
  const double time = scale * static_cast<double>(count);
  if (time > kLongest) return std::nullopt;
  return std::chrono::milliseconds(static_cast<std::int64_t>(time));
}

void refuse_type(Connection& connection, const std::string& message) {
  std::string accepted;
  for (const ContentType& type : kContentTypes)
    accepted += (accepted.empty() ? "" : ", ") + std::string(type.name);
  connection.respond(415, "application/json", connect_error(bad_request(message)),
                     {{"Accept-Post", accepted}});
}

}  // namespace

std::optional<Framing> framing_of(std::string_view content_type) {
  content_type = content_type.substr(0, content_type.find(';'));
  while (!content_type.empty() && content_type.back() == ' ') content_type.remove_suffix(1);
  for (const ContentType& type : kContentTypes)
    if (type.name.size() == content_type.size() &&
        mg_strncasecmp(type.name.data(), content_type.data(), content_type.size()) == 0)
      return type.framing;
  return std::nullopt;
}

std::string content_type_of(const Framing& framing) {
  for (const ContentType& type : kContentTypes)
    if (type.framing.kind == framing.kind && type.framing.encoding == framing.encoding)
      return std::string(type.name);
  return "application/octet-stream";
}

/// One call on its way: where it came in, what it calls, how it is framed.
struct RpcHandler::Call {
  Connection& connection;
  const MethodDescriptor& method;
  Framing framing;
  MemoryBudget& memory;    ///< of the caller
  MemoryShare share = {};  ///< what the request takes

  /// A whole answer that says why the call failed before it began.
  void refuse(const grpc::Status& status) const {
    if (!framing.enveloped()) {
      connection.respond(http_status(status.error_code()), "application/json",
                         connect_error(status));
      return;
    }
    connection.respond(200, content_type_of(framing), end_piece(status));
  }
  /// The last piece of a stream.
  std::string end_piece(const grpc::Status& status) const {
    if (framing.grpc()) return piece(kTrailers, grpc_trailers(status));
    return piece(kEndOfStream, status.ok() ? "{}" : "{\"error\":" + connect_error(status) + "}");
  }
  std::string message_piece(std::string bytes) const {
    return piece(0, transcode(framing.encoding, method.output_type(), std::move(bytes)));
  }

 private:
  std::string piece(unsigned char flags, std::string_view payload) const {
    const std::string bytes = wrap(flags, payload);
    return framing.kind == Kind::grpc_web_text ? to_base64(bytes) : bytes;
  }
};

const MethodDescriptor* RpcHandler::find(std::string_view path) {
  constexpr std::string_view kPackage = "/mbcosim.v1.";
  const std::size_t slash = path.rfind('/');
  if (path.substr(0, kPackage.size()) != kPackage || slash < kPackage.size()) return nullptr;
  const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
      std::string(path.substr(1, slash - 1)));
  return service ? service->FindMethodByName(std::string(path.substr(slash + 1))) : nullptr;
}

// A message may take hundreds of times the bytes of its body.
grpc::Status RpcHandler::read_counted(Call& call, std::string* request) const {
  try {
    return within(call.memory, nullptr, &call.share, [&] { return read_request(call, request); });
  } catch (const Refusal& refusal) {
    return refusal.status();
  }
}

grpc::Status RpcHandler::read_request(Call& call, std::string* request) const {
  std::string body;
  switch (call.connection.read_body(limits_.body_bytes, &body)) {
    case Connection::Body::complete:
      break;
    case Connection::Body::too_long:
      return limit_refusal("message_bytes", static_cast<long long>(limits_.body_bytes),
                           "the body is longer than a message may be")
          .status();
    case Connection::Body::broken:
      return bad_request("the body ended before its announced length");
  }
  if (call.framing.kind == Kind::grpc_web_text) {
    auto bytes = from_base64(body);
    if (!bytes) return bad_request("the body is not base64");
    body = std::move(*bytes);
  }
  std::string_view payload = body;
  if (call.framing.enveloped()) {
    std::string_view rest = body;
    const auto envelope = unwrap(&rest);
    if (!envelope || !rest.empty())
      return bad_request(
          "the body must be one message in an envelope: a byte of flags, its length "
          "in 4 bytes, big-endian, and its bytes");
    if (envelope->flags & kCompressed) return not_served("messages cannot be compressed");
    payload = envelope->payload;
  }
  const auto message = new_message(call.method.input_type());
  const std::string complaint = decode(call.framing.encoding, payload, message.get());
  if (!complaint.empty()) return bad_request(complaint);
  return message->SerializeToString(request) ? grpc::Status::OK
                                             : bad_request("the message is too large");
}

void RpcHandler::answer_whole(Call& call, GenericCall& rpc, const std::string& request) {
  GenericCall::Answer answer = rpc.ask(request);
  if (!answer.status.ok()) return call.refuse(answer.status);
  MemoryShare share;
  const std::string body = within(call.memory, nullptr, &share, [&] {
    if (!call.framing.enveloped())
      return transcode(call.framing.encoding, call.method.output_type(), std::move(answer.reply));
    return call.message_piece(std::move(answer.reply)) + call.end_piece(grpc::Status::OK);
  });
  call.connection.respond(200, content_type_of(call.framing), body,
                          {{"Cache-Control", "no-store"}});
}

void RpcHandler::answer_pieces(Call& call, GenericCall& rpc, const std::string& request) {
  rpc.start(request);
  bool open = call.connection.start_stream(content_type_of(call.framing));
  while (open) {
    auto reply = rpc.receive();
    if (!reply) break;
    open = call.connection.send_piece(call.message_piece(std::move(*reply)));
  }
  if (!open) rpc.cancel();
  const grpc::Status status = rpc.finish();
  if (!open) return;
  call.connection.end_stream(call.end_piece(status));
}

void RpcHandler::serve(Connection& connection, const MethodDescriptor& method,
                       const std::string& identity, const std::string& authorization) {
  const auto framing = framing_of(connection.header("Content-Type"));
  if (!framing) return refuse_type(connection, "unknown content type");
  const bool streams = method.server_streaming();
  if (!framing->grpc() && streams != (framing->kind == Kind::stream) && !method.client_streaming())
    return refuse_type(connection, streams ? method.name() +
                                                 " answers with a stream: send "
                                                 "application/connect+json or +proto"
                                           : method.name() +
                                                 " has one answer: send "
                                                 "application/json or application/proto");
  Call call{connection, method, *framing, budgets_.of(identity)};
  if (method.client_streaming())
    return call.refuse(
        not_served(method.name() + " takes a stream of requests, which plain HTTP cannot carry"));
  const std::string_view packed = connection.header("Content-Encoding");
  if (!packed.empty() && packed != "identity")
    return call.refuse(not_served("bodies cannot be compressed"));

  std::optional<std::chrono::milliseconds> timeout;
  try {
    timeout = timeout_of(connection, framing->grpc());
  } catch (const Refusal& refusal) {
    return call.refuse(refusal.status());
  }
  GenericCall::Metadata metadata;
  if (!authorization.empty()) metadata.emplace_back("authorization", authorization);
  for (const char* name : kMetadata)
    if (connection.has_header(name)) metadata.emplace_back(name, connection.header(name));
  for (const auto& [name, value] : metadata)
    if (!is_metadata(value))
      return call.refuse(
          bad_request("the header " + name + " has bytes other than printable ASCII"));
  // Others have connections, too, and so have those who ask whether the daemon is well.
  const Place call_place(calls_, identity);
  if (!call_place.held())
    return call.refuse(limit_refusal("http_calls", limits_.calls_per_identity,
                                     "too many calls are under way over HTTP; wait for some")
                           .status());
  std::optional<Place> place;
  if (streams && !place.emplace(streams_, identity).held())
    return call.refuse(limit_refusal("http_streams", limits_.streams_per_identity,
                                     "too many streams are open over HTTP; close some")
                           .status());
  std::string request;
  const grpc::Status readable = read_counted(call, &request);
  if (!readable.ok()) return call.refuse(readable);
  GenericCall rpc(channel_, "/" + method.service()->full_name() + "/" + method.name(), metadata,
                  timeout, [&] { return closing_.load() || connection.gone(); });
  streams ? answer_pieces(call, rpc, request) : answer_whole(call, rpc, request);
}

}  // namespace mbcosim::server::http
