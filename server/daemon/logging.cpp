#include "daemon/logging.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "rpc/call_scope.h"
#include "service/event_log.h"
#include "service/library_log.h"

namespace mbcosim::server {
namespace {

std::string json_text(const nlohmann::json& text) {
  return text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// The message as a JSON string.
class JsonMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const nlohmann::json text = std::string(message.payload.data(), message.payload.size());
    const std::string line = json_text(text);
    out.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JsonMessage>();
  }
};

/// What the line is about and the call that it is written for: as members of the JSON object, or
/// what a line of text does not say anyhow.
class Fields : public spdlog::custom_flag_formatter {
 public:
  explicit Fields(bool json) : json_(json) {}
  void format(const spdlog::details::log_msg&, const std::tm&, spdlog::memory_buf_t& out) override {
    if (json_)
      for (const auto& [name, value] : EventLog::fields()) put(name, value, out);
    const CallLabels* call = CallScope::current();
    if (!call) return;
    if (json_) put("method", call->method, out);
    if (json_) put("identity", call->identity, out);
    put("request_id", call->request_id, out);
    put("trace_id", call->trace_id, out);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<Fields>(json_);
  }

 private:
  void put(const std::string& name, const std::string& value, spdlog::memory_buf_t& out) const {
    if (value.empty()) return;
    const std::string text = json_ ? ",\"" + name + "\":" + json_text(value)
                                   : " " + name + "=" + printable(value.substr(0, 200));
    out.append(text.data(), text.data() + text.size());
  }
  const bool json_;
};

/// gRPC's own lines, without the place in its sources.
void log_grpc(gpr_log_func_args* args) {
  static LibraryLog log("gRPC");
  log.tell(args->severity == GPR_LOG_SEVERITY_ERROR  ? spdlog::level::warn
           : args->severity == GPR_LOG_SEVERITY_INFO ? spdlog::level::info
                                                     : spdlog::level::debug,
           args->message);
}

void log_protobuf(google::protobuf::LogLevel severity, const char*, int,
                  const std::string& message) {
  static LibraryLog log("protobuf");
  log.tell(severity >= google::protobuf::LOGLEVEL_ERROR     ? spdlog::level::warn
           : severity == google::protobuf::LOGLEVEL_WARNING ? spdlog::level::info
                                                            : spdlog::level::debug,
           message);
}

}  // namespace

void start_logging(const Config& config) {
  auto logger = spdlog::stderr_color_mt("mbcosimd");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  const bool json = config.log_format == "json";
  formatter->add_flag<JsonMessage>('*').add_flag<Fields>('&', json);
  formatter->set_pattern(
      json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l","thread":%t,"message":%*%&})"
           : "%Y-%m-%d %H:%M:%S.%e %^%l%$ %v%&");
  logger->set_formatter(std::move(formatter));
  logger->set_level(spdlog::level::from_str(config.log_level));
  spdlog::set_default_logger(logger);
  gpr_set_log_function(log_grpc);
  google::protobuf::SetLogHandler(log_protobuf);
}

}  // namespace mbcosim::server
