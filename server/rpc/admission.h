/// How many calls and streams there may be, of all, of one identity and of one connection.
#pragma once

#include <map>
#include <string>

#include "threads/mutex.h"

namespace mbcosim::server {

/// Thread-safe.
class Admission {
 public:
  struct Limits {
    int calls = 0;             ///< calls and streams of all callers
    int identity_calls = 0;    ///< calls with one answer of one identity
    int identity_streams = 0;  ///< streams of one identity
    int connection_calls = 0;  ///< calls and streams over one connection
  };
  explicit Admission(const Limits& limits) : limits_(limits) {}

  /// A place for one call while it lives.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&& other) noexcept { swap(other); }
    Ticket& operator=(Ticket&& other) noexcept {
      swap(other);
      return *this;
    }
    ~Ticket();

   private:
    friend class Admission;
    Ticket(Admission* admission, std::string identity, std::string connection, bool stream)
        : admission_(admission),
          identity_(std::move(identity)),
          connection_(std::move(connection)),
          stream_(stream) {}
    void swap(Ticket& other) noexcept;
    Admission* admission_ = nullptr;
    std::string identity_, connection_;
    bool stream_ = false;
  };
  /// Throws LIMIT_EXCEEDED with the limit's name. `connection`: empty when connections cannot be
  /// told apart.
  Ticket admit(const std::string& identity, const std::string& connection, bool stream);
  /// Calls and streams at once.
  int open() const TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    return all_;
  }

  /// Identities and connections that have any.
  std::size_t known() const TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    return identities_.size() + connections_.size();
  }

 private:
  struct Count {
    int calls = 0, streams = 0;
  };
  void leave(const Ticket& ticket);

  const Limits limits_;
  mutable Mutex mutex_;
  int all_ TS_GUARDED_BY(mutex_) = 0;
  std::map<std::string, Count> identities_ TS_GUARDED_BY(mutex_);
  std::map<std::string, int> connections_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
