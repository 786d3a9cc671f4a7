#include "http/rpc_error.h"

#include <array>
#include <memory>

#include "http/codec.h"
#include "mbcosim/v1/common.pb.h"

namespace mbcosim::server::http {
namespace {

struct CodeRow {
  const char* name;
  int http;
};

// In the order of gRPC's numbers.
constexpr std::array<CodeRow, 17> kCodes{{{"ok", 200},
                                          {"canceled", 499},
                                          {"unknown", 500},
                                          {"invalid_argument", 400},
                                          {"deadline_exceeded", 504},
                                          {"not_found", 404},
                                          {"already_exists", 409},
                                          {"permission_denied", 403},
                                          {"resource_exhausted", 429},
                                          {"failed_precondition", 400},
                                          {"aborted", 409},
                                          {"out_of_range", 400},
                                          {"unimplemented", 501},
                                          {"internal", 500},
                                          {"unavailable", 503},
                                          {"data_loss", 500},
                                          {"unauthenticated", 401}}};

const CodeRow& row(grpc::StatusCode code) {
  const auto index = static_cast<std::size_t>(code);
  return kCodes[index < kCodes.size() ? index : 2];
}

// Our own types by their names, and google.rpc.ErrorInfo, of which ours has the fields.
std::unique_ptr<google::protobuf::Message> unpacked(const google::protobuf::Any& detail,
                                                    const std::string& type) {
  const auto* descriptor =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(
          type == "google.rpc.ErrorInfo" ? "mbcosim.v1.ErrorInfo" : type);
  if (!descriptor) return nullptr;
  const auto* prototype =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(descriptor);
  std::unique_ptr<google::protobuf::Message> message(prototype->New());
  return message->ParseFromString(detail.value()) ? std::move(message) : nullptr;
}

std::string detail_json(const google::protobuf::Any& detail) {
  const std::string type = detail.type_url().substr(detail.type_url().rfind('/') + 1);
  std::string value = to_base64(detail.value());
  value.resize(value.find_last_not_of('=') + 1);  // Connect leaves the padding out
  std::string text = "{\"type\":" + json_string(type) + ",\"value\":" + json_string(value);
  if (const auto message = unpacked(detail, type))
    text += ",\"debug\":" + encode(Encoding::json, *message);
  return text + "}";
}

// As RFC 3986 has it: all but printable ASCII, and the percent sign itself.
std::string percent_encoded(const std::string& text) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7f && c != '%') {
      result += c;
    } else {
      result += '%';
      result += kDigits[byte >> 4];
      result += kDigits[byte & 15];
    }
  }
  return result;
}

}  // namespace

const char* connect_code(grpc::StatusCode code) { return row(code).name; }
int http_status(grpc::StatusCode code) { return row(code).http; }

std::string connect_error(const grpc::Status& status) {
  std::string text = std::string("{\"code\":\"") + connect_code(status.error_code()) +
                     "\",\"message\":" + json_string(status.error_message());
  v1::ErrorStatus details;
  if (details.ParseFromString(status.error_details()) && details.details_size() > 0) {
    text += ",\"details\":[";
    for (int i = 0; i < details.details_size(); ++i)
      text += (i > 0 ? "," : "") + detail_json(details.details(i));
    text += "]";
  }
  return text + "}";
}

std::string grpc_trailers(const grpc::Status& status) {
  std::string text = "grpc-status: " + std::to_string(status.error_code()) + "\r\n";
  if (!status.error_message().empty())
    text += "grpc-message: " + percent_encoded(status.error_message()) + "\r\n";
  if (!status.error_details().empty())
    text += "grpc-status-details-bin: " + to_base64(status.error_details()) + "\r\n";
  return text;
}

}  // namespace mbcosim::server::http
