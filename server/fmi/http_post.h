/// Calls over HTTP/1.1 to one host, on one connection that is kept. Every wait is bounded. Of our
/// own, as an FMU carries with it what it links: Debian's clients bring a TLS library and more, and
/// cpp-httplib bounds single reads, not a call.
#pragma once

#include <chrono>
#include <stdexcept>
#include <string>
#include <string_view>

namespace mbcosim::fmi {

/// The host cannot be reached, is silent, or what it says is no HTTP.
class HttpFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct HttpAnswer {
  int status = 0;
  std::string body;
};

class HttpHost {
 public:
  /// `host`: name or address; `timeout`: longest time of one call, beside what the system takes to
  /// find a name [s]; `token`: bearer token, or empty.
  HttpHost(std::string host, std::string port, std::string token, double timeout);
  ~HttpHost();
  HttpHost(const HttpHost&) = delete;
  HttpHost& operator=(const HttpHost&) = delete;

  /// Throws HttpFailure. A kept connection that the host has closed is opened anew, once.
  HttpAnswer post(const std::string& path, const std::string& type, const std::string& body);
  void set_timeout(double seconds);
  std::chrono::milliseconds timeout() const { return timeout_; }

 private:
  using Clock = std::chrono::steady_clock;
  void open();
  void close();
  std::string silent() const;
  void await(short events);
  void send(std::string_view bytes);
  void fill();
  std::string take(std::size_t size);
  std::string take_line();
  HttpAnswer receive();
  std::string receive_chunks();

  const std::string host_, port_, token_;
  std::chrono::milliseconds timeout_;
  Clock::time_point end_;  ///< of the present call
  int descriptor_ = -1;    ///< negative: none
  std::string buffer_;     ///< received, not taken
};

}  // namespace mbcosim::fmi
