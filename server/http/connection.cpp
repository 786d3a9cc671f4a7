#include "http/connection.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <ctime>

#include "http/sockets.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kRestTime{10000};  // for what is left of a refused request
constexpr std::size_t kPiece = 1 << 13;  // bytes; civetweb's threads have stacks of 100 KiB

// civetweb would write the date by gmtime, whose result all threads share.
std::string date_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  std::array<char, 64> text{};
  return {text.data(),
          std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &parts)};
}

/// The head of an answer. civetweb would send it line by line, and wake the client with each.
class Head {
 public:
  Head(mg_connection* raw, int status, std::string_view content_type)
      : raw_(raw),
        text_("HTTP/1.1 " + std::to_string(status) + ' ' + mg_get_response_code_text(raw, status) +
              "\r\n") {
    add("Date", date_now());
    add("Content-Type", content_type);
    add("X-Content-Type-Options", "nosniff");
  }
  void add(std::string_view name, std::string_view value) {
    text_.append(name).append(": ").append(value).append("\r\n");
  }
  void add(const Headers& headers) {
    for (const auto& [name, value] : headers) add(name, value);
  }
  void keep_connection(bool keep) {
    if (!keep) mg_disable_connection_keep_alive(raw_);
    add("Connection", keep ? "keep-alive" : "close");
  }
  /// Nothing can be added after it.
  std::string& end() { return text_.append("\r\n"); }

 private:
  mg_connection* raw_;
  std::string text_;
};

/// Of a body that is `chunked` (RFC 9112, 7.1); an empty one is its end.
std::string chunk(std::string_view bytes) {
  std::array<char, 2 * sizeof bytes.size()> size{};
  const char* const end = std::to_chars(size.begin(), size.end(), bytes.size(), 16).ptr;
  std::string text(size.data(), static_cast<std::size_t>(end - size.data()));
  return text.append("\r\n").append(bytes).append("\r\n");
}

/// In whatever case.
bool is_same(std::string_view word, std::string_view other) {
  return word.size() == other.size() && mg_strncasecmp(word.data(), other.data(), word.size()) == 0;
}

/// Is `word` one of "a, b, c"?
bool is_one_of(std::string_view word, std::string_view list) {
  while (!list.empty()) {
    std::string_view each = list.substr(0, list.find(','));
    list.remove_prefix(std::min(each.size() + 1, list.size()));
    each.remove_prefix(std::min(each.find_first_not_of(' '), each.size()));
    each = each.substr(0, each.find_last_not_of(' ') + 1);
    if (is_same(each, word)) return true;
  }
  return false;
}

// civetweb does not tell the socket of a connection: it is the one with this peer at the door's
// port. One peer may have connections to other ports of the daemon, too.
int socket_of(mg_connection* raw, const mg_request_info& info) {
  auto* peer = static_cast<Peer*>(mg_get_user_connection_data(raw));
  if (!peer) {
    peer = new Peer;  // deleted by the door when the connection closes
    const Endpoint wanted{info.remote_addr, info.remote_port};
    peer->socket = find_socket(info.server_port, [&](int fd) { return peer_of(fd) == wanted; });
    mg_set_user_connection_data(raw, peer);
  }
  return peer->socket;
}

}  // namespace

const char* fault_of(const mg_request_info& request) {
  const auto count = [&](std::string_view name) {
    return std::count_if(request.http_headers, request.http_headers + request.num_headers,
                         [&](const auto& header) { return is_same(header.name, name); });
  };
  const auto is_number = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  for (int k = 0; k < request.num_headers; ++k) {
    const std::string_view name = request.http_headers[k].name,
                           value = request.http_headers[k].value;
    if (is_same(name, "Content-Length") && !is_number(value)) return "Content-Length is no number";
    if (is_same(name, "Transfer-Encoding") && !is_same(value, "chunked"))
      return "the only transfer coding that is read is chunked";
  }
  const auto lengths = count("Content-Length"), codings = count("Transfer-Encoding");
  if (lengths > 1 || codings > 1) return "the length of the body is told twice";
  if (lengths > 0 && codings > 0) return "Content-Length and Transfer-Encoding exclude each other";
  if (count("Host") > 1) return "the host is named twice";
  return nullptr;
}

int answer_malformed(mg_connection* raw, int status, const char* message) {
  const std::string body = std::string(message) + '\n';
  Head head(raw, status, kPlainText);
  head.add("Content-Length", std::to_string(body.size()));
  head.keep_connection(false);
  const std::string& answer = head.end().append(body);
  mg_write(raw, answer.data(), answer.size());
  return 0;
}

void Peer::look_for_request() {
  static std::atomic_flag somebody_looks;  // many clients, however quick, keep one core awake
  if (socket < 0) return;
  for_request.begin(Alertness::Clock::now());
  if (somebody_looks.test_and_set()) return;
  for_request.sees([this] {
    pollfd state{socket, POLLIN, 0};
    return ::poll(&state, 1, 0) != 0;
  });
  somebody_looks.clear();
}

Connection::Connection(mg_connection* raw, Reaper& reaper, Crowd& crowd)
    : raw_(raw),
      info_(mg_get_request_info(raw)),
      reaper_(reaper),
      crowd_(crowd),
      socket_(socket_of(raw, *info_)) {
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

/// For what the client may never send, or read: others need not wait for that.
class Connection::Waiting {
 public:
  explicit Waiting(Connection& connection) : of_(connection) { of_.crowd_.waits(of_.socket_); }
  ~Waiting() { of_.crowd_.goes_on(of_.socket_); }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  /// So many bytes have come, or gone; none where it is negative.
  void moved(std::int64_t bytes) {
    if (bytes <= 0 || (since_ += bytes) < Crowd::kProgress) return;
    since_ = 0;
    of_.crowd_.moves(of_.socket_);
  }
  /// Bytes, 0 at the end, negative when the connection is lost.
  int read(std::array<char, kPiece>& piece) {
    const int count = mg_read(of_.raw_, piece.data(), piece.size());
    moved(count);
    return count;
  }

 private:
  Connection& of_;
  std::int64_t since_ = 0;  ///< bytes
};

Connection::Body Connection::read_body(std::size_t limit, std::string* body) {
  body->clear();
  if (info_->content_length > static_cast<long long>(limit)) return Body::too_long;
  reaper_.arm(socket_, kTransferTime);
  if (waits_for_leave() && !write("HTTP/1.1 100 Continue\r\n\r\n")) return Body::broken;
  std::array<char, kPiece> piece;
  for (Waiting waiting(*this);;) {
    const int count = waiting.read(piece);
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

/// Does the client send the body when it is told to (RFC 9110, 10.1.1)?
bool Connection::waits_for_leave() const {
  return is_one_of("100-continue", header("Expect")) && is_of_version_1_1();
}

bool Connection::is_of_version_1_1() const {
  return info_->http_version && std::string_view(info_->http_version) == "1.1";
}

/// Is the connection kept? So does civetweb read it from the request; it upgrades nothing.
bool Connection::stays() const {
  const std::string_view wishes = header("Connection");
  if (has_header("Connection"))
    return is_one_of("keep-alive", wishes) && !is_one_of("upgrade", wishes);
  return is_of_version_1_1();
}

void Connection::respond(int status, std::string_view content_type, std::string_view body,
                         const Headers& headers) {
  status_ = status;
  reaper_.arm(socket_, kTransferTime);
  const bool unread = !body_read_ && info_->content_length != 0 && method() == "POST";
  Head head(raw_, status, content_type);
  head.add(headers);
  head.add("Content-Length", std::to_string(body.size()));
  head.keep_connection(!unread && stays());
  constexpr std::size_t kTogether = 1 << 16;  // bytes
  if (method() == "HEAD") body = {};
  const bool together = body.size() <= kTogether;
  std::string& begin = together ? head.end().append(body) : head.end();
  if (!send_all(begin) || (!together && !send_all(body))) return;
  if (unread && !waits_for_leave()) drop_rest();
}

// A connection that is closed before it was read to its end is reset: the client, which still
// sends, would never see the answer (RFC 9112, 9.6). Whoever sends slowly is cut off.
void Connection::drop_rest() {
  reaper_.arm(socket_, kRestTime);
  std::array<char, kPiece> piece;
  Waiting waiting(*this);
  while (waiting.read(piece) > 0) continue;
}

bool Connection::start_stream(std::string_view content_type, const Headers& headers) {
  status_ = 200;
  reaper_.arm(socket_, kTransferTime);
  Head head(raw_, status_, content_type);
  head.add(headers);
  if (is_of_version_1_1()) head.add("Transfer-Encoding", "chunked");
  head.add("Cache-Control", "no-store");
  head.add("X-Accel-Buffering", "no");  // nginx would keep pieces until they are many
  head.keep_connection(is_of_version_1_1() && stays());
  const bool sent = send_all(head.end());
  reaper_.disarm(socket_);
  return sent && !gone();
}

bool Connection::send_piece(std::string_view bytes) {
  if (bytes.empty()) return true;
  const bool sent = send_all(is_of_version_1_1() ? chunk(bytes) : std::string(bytes));
  reaper_.disarm(socket_);
  return sent;
}

void Connection::end_stream(std::string_view last_piece) {
  if (is_of_version_1_1())
    send_all(chunk(last_piece) + chunk({}));
  else
    send_all(last_piece);  // the end of the connection is that of the body
}

// Where a part of an answer is missing, the next one would be taken for it.
bool Connection::send_all(std::string_view bytes) {
  reaper_.arm(socket_, kTransferTime);
  if (write(bytes)) return true;
  mg_disable_connection_keep_alive(raw_);
  ::shutdown(socket_, SHUT_RDWR);
  return false;
}

// civetweb would look whether the client reads only now and then, and give up too early.
bool Connection::write(std::string_view bytes) {
  if (socket_ < 0)
    return mg_write(raw_, bytes.data(), bytes.size()) == static_cast<int>(bytes.size());
  std::optional<Waiting> waiting;
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
      if (waiting) waiting->moved(count);
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) return false;
    if (!waiting) waiting.emplace(*this);
    pollfd state{socket_, POLLOUT, 0};
    if (::poll(&state, 1, kTransferTime.count()) == 0) return false;
  }
  return true;
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
