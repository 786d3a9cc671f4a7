#include "fmi/remote.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "fmi/http_post.h"
#include "fmi/remote_address.h"
#include "math/hash.h"

namespace mbcosim::fmi {
namespace {

using nlohmann::json;

constexpr const char* kUnary = "application/json";
constexpr const char* kStream = "application/connect+json";
constexpr double kLongestTimeout = 1e6;  ///< [s]

Error lost(const std::string& message) { return make_error(ErrorKind::peer, "", message); }

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

/// Empty: none. Blanks around it do not count.
Result<std::string> read_token() {
  std::string token = environment("MBCOSIM_TOKEN"), from = "MBCOSIM_TOKEN";
  if (const std::string path = environment("MBCOSIM_TOKEN_FILE"); token.empty() && !path.empty()) {
    from = "the file \"" + path + "\" of MBCOSIM_TOKEN_FILE";
    std::ifstream in(path);
    if (!std::getline(in, token)) return lost("cannot read a token for the daemon from " + from);
  }
  const auto is_shown = [](unsigned char c) { return c > ' ' && c < 127; };
  const auto first = std::find_if(token.begin(), token.end(), is_shown);
  const auto last = std::find_if(token.rbegin(), std::make_reverse_iterator(first), is_shown);
  token = std::string(first, last.base());
  if (!std::all_of(token.begin(), token.end(), is_shown))
    return lost("what " + from + " has is no token for the daemon");
  return token;
}

std::string new_request_id() {
  std::random_device random;
  char text[40];
  std::snprintf(text, sizeof text, "fmu-%08x%08x%08x", random(), random(), random());
  return text;
}

// ------------------------------------------------------------------ base64, as JSON has bytes

constexpr std::string_view kLetters =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string to_base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < n ? static_cast<unsigned char>(bytes[at + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kLetters[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// What is no letter is left out: the checksum of a state tells what is wrong with it.
std::string from_base64(std::string_view text) {
  std::string bytes;
  std::uint32_t group = 0;
  int bits = 0;
  for (const char letter : text) {
    const std::size_t value = kLetters.find(letter);
    if (value == std::string_view::npos) continue;
    group = group << 6 | static_cast<std::uint32_t>(value);
    if ((bits += 6) < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> bits & 255);
  }
  return bytes;
}

// ------------------------------------------------------------------ Connect's messages

/// Flags, length, and the message.
std::string enveloped(const std::string& message) {
  std::string bytes(5, '\0');
  for (std::size_t k = 0; k < 4; ++k)
    bytes[1 + k] = static_cast<char>(message.size() >> (24 - 8 * k) & 255);
  return bytes + message;
}

/// A refused argument (the length of a step) is like one that the engine inside refuses.
Error error_of(const json& error) {
  const std::string code = error.value("code", "");
  const bool refused = code == "invalid_argument" || code == "out_of_range";
  return make_error(refused ? ErrorKind::argument : ErrorKind::peer, code,
                    "the daemon: " + error.value("message", code));
}

/// The messages of a stream as an array, without its end.
Result<json> messages_of(std::string_view body) {
  constexpr unsigned char kEnd = 2;
  json all = json::array();
  while (body.size() >= 5) {
    std::size_t size = 0;
    for (std::size_t k = 1; k < 5; ++k) size = size << 8 | static_cast<unsigned char>(body[k]);
    if (size > body.size() - 5) break;
    json message = json::parse(body.substr(5, size));
    if ((static_cast<unsigned char>(body[0]) & kEnd) == 0) {
      all.push_back(std::move(message));
    } else {
      if (message.contains("error")) return error_of(message["error"]);
      return all;
    }
    body.remove_prefix(5 + size);
  }
  return lost("the daemon's answer is cut");
}

json to_json(const SymbolValues& symbols) {
  json all = json::object();
  for (const auto& [name, value] : symbols) {
    json& one = all[name];
    if (const auto* text = std::get_if<std::string>(&value))
      one["text"] = *text;
    else if (const bool* flag = std::get_if<bool>(&value))
      one["flag"] = *flag;
    else if (const double* real = std::get_if<double>(&value))
      one["number"] = *real;
    else
      one["number"] = static_cast<double>(std::get<std::int32_t>(value));
  }
  return all;
}

}  // namespace

struct Remote::Connection {
  std::string address;
  HttpHost host;
};

Remote::Remote(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}

Remote::~Remote() {
  if (simulation_.empty()) return;
  try {
    connection_->host.set_timeout(2);
    (void)call("DeleteSimulation", json::object());
  } catch (const std::exception&) {  // its lease ends it
  }
}

Error Remote::is_no_daemon(const std::string& why) const {
  return lost("what answers at " + connection_->address + " is no daemon (" + why + ")");
}

Result<json> Remote::call(const std::string& method, json request, bool answers_are_a_stream) {
  if (!simulation_.empty()) request["simulation"] = simulation_;
  const std::string text = request.dump(-1, ' ', false, json::error_handler_t::replace);
  HttpAnswer answer;
  try {
    answer = connection_->host.post("/mbcosim.v1.Simulations/" + method,
                                    answers_are_a_stream ? kStream : kUnary,
                                    answers_are_a_stream ? enveloped(text) : text);
  } catch (const HttpFailure& failure) {
    return lost("the daemon at " + connection_->address + " cannot be reached: " + failure.what());
  }
  try {
    if (answers_are_a_stream && answer.status == 200) return messages_of(answer.body);
    const json reply = json::parse(answer.body);
    if (reply.is_object() && answer.status != 200) return error_of(reply);
    if (reply.is_object()) return reply;
  } catch (const json::exception&) {  // as below
  }
  return is_no_daemon("HTTP status " + std::to_string(answer.status));
}

Result<std::unique_ptr<Remote>> Remote::create(const Manifest& manifest,
                                               const std::map<std::string, std::string>& files,
                                               const Choice& choice) {
  const auto address = parse_remote(manifest.remote);
  if (!address) return address.error();
  const double timeout = manifest.remote_timeout;
  if (!(timeout > 0 && timeout <= kLongestTimeout))
    return make_error(ErrorKind::data_loss, "", "resources/mbcosim.json: remote_timeout is wrong");
  auto token = read_token();
  if (!token) return token.error();
  std::unique_ptr<Remote> remote(new Remote(std::unique_ptr<Connection>(
      new Connection{manifest.remote, HttpHost(address->host, address->port, *token, timeout)})));
  json request;
  request["header"]["bundleMainFile"] = manifest.deck;
  json& options = request["header"]["options"];
  options["requestId"] = new_request_id();
  options["displayName"] = choice.display_name;
  options["summedTime"] = true;
  options["optionalPorts"] = true;  // the importer sets their inputs
  options["durability"] = "DURABILITY_NONE";
  options["symbols"] = to_json(choice.symbols);
  request["files"] = json::array();
  for (const auto& [name, content] : files)
    request["files"].push_back({{"path", name}, {"data", to_base64(content)}});
  if (auto created = remote->create(std::move(request), choice.model_digest); !created)
    return created.error();
  return remote;
}

mbcosim::Status Remote::create(json request, std::uint64_t model_digest) {
  const auto reply = call("CreateSimulationInline", std::move(request));
  if (!reply) return reply.error();
  try {
    const json& simulation = reply->at("simulation");
    simulation_ = simulation.at("name").get<std::string>();
    if (simulation.at("modelDigest") != digest_text(model_digest))
      return lost("the daemon reads another model from the deck: take one of this FMU's version");
  } catch (const json::exception& e) {
    return is_no_daemon(e.what());
  }
  return ok();
}

Result<Remote::Step> Remote::step(std::optional<double> end) {
  json request{{"requestId", new_request_id()}, {"expectedStep", number_}};
  if (end) {
    request["untilTime"] = *end;
    request["exact"] = true;
  } else {
    request["steps"] = 1;
  }
  auto reply = call("Step", std::move(request));
  if (!reply) return reply.error();
  try {
    if (reply->contains("failure"))
      return make_error(ErrorKind::not_converged, "",
                        reply->at("failure").value("message", "the step failed"));
    const std::string outcome = reply->at("outcome");
    if (reply->at("stepsDone") == "0") {
      const bool finished = outcome == "STEP_OUTCOME_FINISHED";
      if (finished && reply->at("largestStepSize") != 0) return Step{.ended = true};
      return make_error(ErrorKind::precondition, "",
                        finished ? "the daemon's simulation ends at the deck's final time"
                                 : "the daemon took no step: " + outcome);
    }
    const std::string number = reply->at("step");
    const auto [rest, code] =
        std::from_chars(number.data(), number.data() + number.size(), number_);
    if (code != std::errc() || *rest != '\0') return is_no_daemon("its step is \"" + number + "\"");
    return Step{.size = reply->at("stepSize"), .next_size = reply->at("nextStepSize")};
  } catch (const json::exception& e) {
    return is_no_daemon(e.what());
  }
}

/// A daemon serves few streams at once; an instance waits for its turn.
Result<json> Remote::export_in_turn() {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kLongestPause(200);
  const auto end = Clock::now() + connection_->host.timeout();
  for (std::chrono::milliseconds pause(5);; pause = std::min(2 * pause, kLongestPause)) {
    auto pieces = call("ExportSnapshot", json::object(), true);
    if (pieces || pieces.error().reason != "resource_exhausted" || Clock::now() >= end)
      return pieces;
    std::this_thread::sleep_for(pause);
  }
}

Result<std::string> Remote::state() {
  auto pieces = export_in_turn();
  if (!pieces) return pieces.error();
  try {
    std::string bytes;
    for (const json& piece : *pieces) bytes += from_base64(piece.at("data").get<std::string>());
    return bytes;
  } catch (const json::exception& e) {
    return is_no_daemon(e.what());
  }
}

mbcosim::Status Remote::go_to(std::string_view state, std::int64_t number) {
  const auto imported =
      call("ImportSnapshotInline",
           {{"requestId", new_request_id()}, {"restore", true}, {"data", to_base64(state)}});
  if (!imported) return imported.error();
  number_ = number;
  try {
    const json& snapshot = imported->at("snapshot").at("name");
    if (auto dropped = call("DeleteSnapshot", {{"snapshot", snapshot}}); !dropped)
      return dropped.error();
  } catch (const json::exception& e) {
    return is_no_daemon(e.what());
  }
  return ok();
}

}  // namespace mbcosim::fmi
