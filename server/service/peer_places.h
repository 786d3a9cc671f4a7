/// Places for peers, so that one caller cannot take all.
#pragma once

#include <map>
#include <string>

#include "threads/mutex.h"

namespace mbcosim::server {

/// So many places. Where there are several callers, each may have as many as are free for others:
/// one alone gets half of them, two get a third each, and who comes next always finds some.
/// Thread-safe.
class PeerPlaces {
 public:
  PeerPlaces(int most, bool several) : most_(most), several_(several) {}

  /// One place while it lives.
  class Place {
   public:
    /// Throws LIMIT_EXCEEDED: `shared_memory_peers`, or `identity_shared_memory_peers` when others
    /// would still get one.
    Place(PeerPlaces& places, const std::string& identity) : places_(places), identity_(identity) {
      places_.take(identity_);
    }
    ~Place() { places_.give_back(identity_); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    PeerPlaces& places_;
    const std::string identity_;
  };

 private:
  void take(const std::string& identity) TS_EXCLUDES(mutex_);
  void give_back(const std::string& identity) TS_EXCLUDES(mutex_);

  const int most_;
  const bool several_;
  Mutex mutex_;
  int taken_ TS_GUARDED_BY(mutex_) = 0;
  std::map<std::string, int> own_ TS_GUARDED_BY(mutex_);  ///< of who has any
};

}  // namespace mbcosim::server
