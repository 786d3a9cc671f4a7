#include "http/connection.h"

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <ctime>

#include "http/sockets.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kLinger{2000};  // for the rest of a request that is refused

// civetweb does not tell the socket of a connection: it is the one with this peer.
int find_socket(const mg_request_info& info) {
  const Endpoint wanted{info.remote_addr, info.remote_port};
  return find_descriptor([&](int fd) { return peer_of(fd) == wanted; });
}

// civetweb would write the date by gmtime, whose result all threads share.
std::string date_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  std::array<char, 64> text{};
  return {text.data(),
          std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &parts)};
}

void start_header(mg_connection* raw, int status, std::string_view content_type) {
  mg_response_header_start(raw, status);
  mg_response_header_add(raw, "Date", date_now().c_str(), -1);
  mg_response_header_add(raw, "Content-Type", content_type.data(),
                         static_cast<int>(content_type.size()));
  mg_response_header_add(raw, "X-Content-Type-Options", "nosniff", -1);
}

int socket_of(mg_connection* raw, const mg_request_info& info) {
  auto* peer = static_cast<Peer*>(mg_get_user_connection_data(raw));
  if (!peer) {
    peer = new Peer{find_socket(info)};  // deleted by the door when the connection closes
    mg_set_user_connection_data(raw, peer);
  }
  return peer->socket;
}

}  // namespace

int answer_malformed(mg_connection* raw, int status, const char* message) {
  const std::string body = std::string(message) + '\n';
  start_header(raw, status, kPlainText);
  mg_response_header_add(raw, "Content-Length", std::to_string(body.size()).c_str(), -1);
  mg_response_header_add(raw, "Connection", "close", -1);
  mg_response_header_send(raw);
  mg_write(raw, body.data(), body.size());
  return 0;
}

Connection::Connection(mg_connection* raw, Reaper& reaper)
    : raw_(raw), info_(mg_get_request_info(raw)), reaper_(reaper), socket_(socket_of(raw, *info_)) {
  reaper_.arm(socket_, kTransferTime);
}

std::string_view Connection::header(const char* name) const {
  const char* value = mg_get_header(raw_, name);
  return value ? value : "";
}

std::string_view Connection::cookie(std::string_view name) const {
  std::string_view rest = header("Cookie");
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(';'), rest.size());
    std::string_view pair = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    pair.remove_prefix(std::min(pair.find_first_not_of(' '), pair.size()));
    if (pair.size() > name.size() && pair.substr(0, name.size()) == name &&
        pair[name.size()] == '=')
      return pair.substr(name.size() + 1);
  }
  return {};
}

Connection::Body Connection::read_body(std::size_t limit, std::string* body) {
  body->clear();
  if (info_->content_length > static_cast<long long>(limit)) return Body::too_long;
  reaper_.arm(socket_, kTransferTime);
  std::array<char, 1 << 13> piece;  // civetweb's threads have stacks of 100 KiB
  for (;;) {
    const int count = mg_read(raw_, piece.data(), piece.size());
    if (count < 0) return Body::broken;
    if (count == 0) break;
    if (body->size() + static_cast<std::size_t>(count) > limit) return Body::too_long;
    body->append(piece.data(), static_cast<std::size_t>(count));
  }
  reaper_.disarm(socket_);
  body_read_ = true;
  const bool cut =
      info_->content_length >= 0 && body->size() < static_cast<std::size_t>(info_->content_length);
  return cut ? Body::broken : Body::complete;
}

void Connection::start_answer(int status, std::string_view content_type, const Headers& headers) {
  status_ = status;
  reaper_.arm(socket_, kTransferTime);
  start_header(raw_, status, content_type);
  for (const auto& [name, value] : headers)
    mg_response_header_add(raw_, name.c_str(), value.data(), static_cast<int>(value.size()));
}

void Connection::respond(int status, std::string_view content_type, std::string_view body,
                         const Headers& headers) {
  start_answer(status, content_type, headers);
  mg_response_header_add(raw_, "Content-Length", std::to_string(body.size()).c_str(), -1);
  const bool unread = !body_read_ && info_->content_length != 0 && method() == "POST";
  if (unread) mg_response_header_add(raw_, "Connection", "close", -1);
  mg_response_header_send(raw_);
  if (method() != "HEAD") mg_write(raw_, body.data(), body.size());
  // civetweb reads on to the end of the request; whoever sends it slowly is cut off.
  if (unread) reaper_.arm(socket_, kLinger);
}

bool Connection::start_stream(std::string_view content_type, const Headers& headers) {
  start_answer(200, content_type, headers);
  mg_response_header_add(raw_, "Transfer-Encoding", "chunked", -1);
  mg_response_header_add(raw_, "Cache-Control", "no-store", -1);
  mg_response_header_send(raw_);
  reaper_.disarm(socket_);
  return !gone();
}

bool Connection::send_piece(std::string_view bytes) {
  if (bytes.empty()) return true;
  reaper_.arm(socket_, kTransferTime);
  const int sent = mg_send_chunk(raw_, bytes.data(), static_cast<unsigned>(bytes.size()));
  reaper_.disarm(socket_);
  return sent > 0;
}

void Connection::end_stream() {
  reaper_.arm(socket_, kTransferTime);
  mg_send_chunk(raw_, "", 0);
}

bool Connection::gone() const {
  if (socket_ < 0) return false;
  pollfd state{socket_, POLLRDHUP, 0};
  return ::poll(&state, 1, 0) > 0 && (state.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

std::optional<std::string> query_value(std::string_view query, const std::string& name) {
  std::string value(query.size() + 1, '\0');
  const int length =
      mg_get_var(query.data(), query.size(), name.c_str(), value.data(), value.size());
  if (length < 0) return std::nullopt;
  value.resize(static_cast<std::size_t>(length));
  return value;
}

}  // namespace mbcosim::server::http
