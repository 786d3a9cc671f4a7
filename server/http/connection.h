/// One HTTP request and the connection that it came over: civetweb behind a small face.
#pragma once

#include <civetweb.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "http/crowd.h"
#include "http/reaper.h"
#include "threads/alertness.h"

namespace mbcosim::server::http {

inline constexpr const char* kPlainText = "text/plain; charset=utf-8";

using Headers = std::vector<std::pair<std::string, std::string>>;

/// What the door keeps for a connection while it lives, in civetweb's connection data.
struct Peer {
  int socket = -1;          ///< -1: not found
  bool in_request = false;  ///< that a Connection stands for
  Alertness for_request;    ///< of the thread that serves it

  /// A request is over: looks for the next one, as long as it is likely to come soon. One thread
  /// of all does.
  void look_for_request();
};

/// Time that a client has to send a request's body, or to read an answer.
inline constexpr std::chrono::milliseconds kTransferTime{30000};

class Connection {
 public:
  Connection(mg_connection* raw, Reaper& reaper, Crowd& crowd);

  std::string_view method() const { return info_->request_method; }
  std::string_view path() const { return info_->local_uri ? info_->local_uri : ""; }
  std::string_view query() const { return info_->query_string ? info_->query_string : ""; }
  /// Empty: the request has none of this name.
  std::string_view header(const char* name) const;
  bool has_header(const char* name) const { return mg_get_header(raw_, name) != nullptr; }
  /// A client asks for a cookie's value; empty: none.
  std::string_view cookie(std::string_view name) const;

  enum class Body { complete, too_long, broken };
  Body read_body(std::size_t limit, std::string* body);

  /// Sends a whole answer. Without a body read before, the rest of the request is dropped.
  void respond(int status, std::string_view content_type, std::string_view body,
               const Headers& headers = {});
  /// Starts an answer that comes in pieces; false: the client is gone.
  bool start_stream(std::string_view content_type, const Headers& headers = {});
  bool send_piece(std::string_view bytes);
  void end_stream(std::string_view last_piece);

  /// Whether the client has hung up. Cheap.
  bool gone() const;
  int status() const { return status_; }

 private:
  bool waits_for_leave() const;
  bool is_of_version_1_1() const;
  bool stays() const;
  void drop_rest();
  bool send_all(std::string_view bytes);
  bool write(std::string_view bytes);
  class Waiting;

  mg_connection* raw_;
  const mg_request_info* info_;
  Reaper& reaper_;
  Crowd& crowd_;
  int socket_ = -1;
  int status_ = 500;
  bool body_read_ = false;
};

/// What is wrong with the head of a request; null: nothing. What leaves open where its body ends, a
/// proxy before the door may have read in another way (RFC 9112, 11.2).
const char* fault_of(const mg_request_info& request);

/// Answers what is no request that a Connection could stand for; 0, as civetweb wants it.
int answer_malformed(mg_connection* raw, int status, const char* message);

/// The value of `name` in "a=1&b=2", decoded.
std::optional<std::string> query_value(std::string_view query, const std::string& name);

}  // namespace mbcosim::server::http
