/// A daemon of one's own: a child process that ends with its parent.
#pragma once

#include <sys/types.h>

#include <string>

namespace mbcosim::view {

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
  /// Waits until the daemon ends or one of the blocked signals SIGINT, SIGTERM comes; the daemon's
  /// exit code, or 0 after a signal.
  int wait();

 private:
  void start(const std::string& program, const std::string& http);
  std::string read_page(double seconds) const;
  void stop();

  std::string folder_, address_, page_;
  pid_t child_ = -1;
  int output_ = -1;  ///< the daemon's standard output
};

}  // namespace mbcosim::view
