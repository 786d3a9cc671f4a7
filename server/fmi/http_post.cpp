#include "fmi/http_post.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace mbcosim::fmi {
namespace {

constexpr std::size_t kMostBody = std::size_t{1} << 30, kMostLine = std::size_t{1} << 16;
constexpr int kMostHeaders = 200;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::size_t size_of(const std::string& text, int base) {
  char* end = nullptr;
  const unsigned long long size = std::strtoull(text.c_str(), &end, base);
  if (text.empty() || text[0] == '-' || (*end != '\0' && *end != ';' && *end != ' ') ||
      size > kMostBody)
    throw HttpFailure("the length of its answer makes no sense");
  return static_cast<std::size_t>(size);
}

}  // namespace

HttpHost::HttpHost(std::string host, std::string port, std::string token, double timeout)
    : host_(std::move(host)), port_(std::move(port)), token_(std::move(token)) {
  set_timeout(timeout);
}

HttpHost::~HttpHost() { close(); }

void HttpHost::set_timeout(double seconds) {
  timeout_ = std::chrono::milliseconds(static_cast<long long>(1000 * seconds));
}

void HttpHost::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  buffer_.clear();
}

std::string HttpHost::silent() const {
  return "no answer within " + std::to_string(timeout_.count()) + " ms";
}

void HttpHost::await(short events) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end_ - Clock::now()).count();
    if (left <= 0) throw HttpFailure(silent());
    pollfd entry{descriptor_, events, 0};
    constexpr long long kSlice = 1000;
    if (::poll(&entry, 1, static_cast<int>(std::min<long long>(left, kSlice))) > 0) return;
  }
}

void HttpHost::open() {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host_.c_str(), port_.c_str(), &hints, &found); code != 0)
    throw HttpFailure(::gai_strerror(code));
  int reason = 0;
  for (const addrinfo* each = found; each && descriptor_ < 0; each = each->ai_next) {
    descriptor_ = ::socket(each->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    reason = errno;
    if (descriptor_ < 0 || ::connect(descriptor_, each->ai_addr, each->ai_addrlen) == 0) continue;
    reason = errno;
    if (reason == EINPROGRESS) {
      try {
        await(POLLOUT);
      } catch (...) {
        ::freeaddrinfo(found);
        throw;
      }
      socklen_t size = sizeof reason;
      ::getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &reason, &size);
    }
    if (reason != 0) close();
  }
  ::freeaddrinfo(found);
  if (descriptor_ < 0) throw HttpFailure(std::strerror(reason));
  const int on = 1;
  ::setsockopt(descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

void HttpHost::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n >= 0)
      bytes.remove_prefix(static_cast<std::size_t>(n));
    else if (errno == EAGAIN || errno == EWOULDBLOCK)
      await(POLLOUT);
    else if (errno != EINTR)
      throw HttpFailure(std::strerror(errno));
  }
}

void HttpHost::fill() {
  char piece[16384];
  if (Clock::now() >= end_) throw HttpFailure(silent());
  for (;;) {
    const ssize_t n = ::recv(descriptor_, piece, sizeof piece, 0);
    if (n > 0) {
      buffer_.append(piece, static_cast<std::size_t>(n));
      return;
    }
    if (n == 0) throw HttpFailure("it closes the connection");
    if (errno == EAGAIN || errno == EWOULDBLOCK)
      await(POLLIN);
    else if (errno != EINTR)
      throw HttpFailure(std::strerror(errno));
  }
}

std::string HttpHost::take(std::size_t size) {
  while (buffer_.size() < size) fill();
  std::string taken = buffer_.substr(0, size);
  buffer_.erase(0, size);
  return taken;
}

std::string HttpHost::take_line() {
  std::size_t end;
  while ((end = buffer_.find("\r\n")) == std::string::npos) {
    if (buffer_.size() > kMostLine) throw HttpFailure("its answer is no HTTP");
    fill();
  }
  std::string line = take(end);
  (void)take(2);
  return line;
}

std::string HttpHost::receive_chunks() {
  std::string body;
  while (const std::size_t size = size_of(take_line(), 16)) {
    if (body.size() + size > kMostBody) throw HttpFailure("its answer is too long");
    body += take(size);
    (void)take_line();
  }
  while (!take_line().empty()) {
  }
  return body;
}

HttpAnswer HttpHost::receive() {
  HttpAnswer answer;
  const std::string first = take_line();
  if (first.rfind("HTTP/1.1 ", 0) != 0) throw HttpFailure("its answer is no HTTP");
  answer.status = std::atoi(first.c_str() + 9);
  std::size_t size = 0;
  bool chunked = false, closes = false;
  int headers = 0;
  for (std::string line; !(line = lower(take_line())).empty();) {
    if (++headers > kMostHeaders) throw HttpFailure("its answer is no HTTP");
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const std::string name = line.substr(0, colon);
    const std::size_t value_at = line.find_first_not_of(' ', colon + 1);
    const std::string value = value_at == std::string::npos ? "" : line.substr(value_at);
    if (name == "content-length") size = size_of(value, 10);
    if (name == "transfer-encoding") chunked = value == "chunked";
    if (name == "connection") closes = value == "close";
  }
  answer.body = chunked ? receive_chunks() : take(size);
  if (closes) close();
  return answer;
}

HttpAnswer HttpHost::post(const std::string& path, const std::string& type,
                          const std::string& body) {
  end_ = Clock::now() + timeout_;
  const bool ipv6 = host_.find(':') != std::string::npos;
  const std::string host = ipv6 ? "[" + host_ + "]" : host_;
  std::string request = "POST " + path + " HTTP/1.1\r\nHost: " + host + ":" + port_ +
                        "\r\nContent-Type: " + type + "\r\n" +
                        (token_.empty() ? "" : "Authorization: Bearer " + token_ + "\r\n") +
                        "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n";
  request += body;  // in one piece: the host wakes once
  for (bool again = descriptor_ >= 0;; again = false) {
    try {
      if (descriptor_ < 0) open();
      send(request);
      return receive();
    } catch (const HttpFailure&) {
      const bool nothing_came = buffer_.empty() && Clock::now() < end_;
      close();
      if (!again || !nothing_came) throw;
    }
  }
}

}  // namespace mbcosim::fmi
