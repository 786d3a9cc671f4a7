/// A daemon of one's own: a child process that ends with its parent.
#pragma once

#include <sys/types.h>

#include <stdexcept>
#include <string>

namespace mbcosim::view {

/// The daemon has ended by itself. The text says how.
class Lost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class PrivateDaemon {
 public:
  /// Starts `program`, listening in a folder that only this user can enter, with its page on
  /// `http` ("HOST:PORT"). Throws std::runtime_error when it does not start within `seconds`.
  PrivateDaemon(const std::string& program, const std::string& http, double seconds);
  /// Ends the daemon and removes its folder.
  ~PrivateDaemon();
  PrivateDaemon(const PrivateDaemon&) = delete;
  PrivateDaemon& operator=(const PrivateDaemon&) = delete;

  const std::string& address() const { return address_; }  ///< "unix:…"
  const std::string& page() const { return page_; }        ///< with the token
  /// Waits until one of the blocked signals SIGINT, SIGTERM comes. Throws Lost when the daemon
  /// ends.
  void wait();

 private:
  void start(const std::string& program, const std::string& http);
  std::string read_page(double seconds) const;
  void stop();

  std::string folder_, address_, page_;
  pid_t child_ = -1;
  int output_ = -1;  ///< the daemon's standard output
};

}  // namespace mbcosim::view
