/// Places for what goes on at once, so that one identity cannot take all.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "threads/mutex.h"

namespace mbcosim::server {

/// So many of each identity, and of all together. Thread-safe.
class Places {
 public:
  Places(int most_per_identity, int most) : most_per_identity_(most_per_identity), most_(most) {}

  int most_per_identity() const { return most_per_identity_; }

 private:
  friend class Place;
  bool enter(const std::string& identity) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    const auto mine = by_identity_.find(identity);
    if (all_ >= most_ || (mine != by_identity_.end() && mine->second >= most_per_identity_))
      return false;
    ++by_identity_[identity];
    ++all_;
    return true;
  }
  void leave(const std::string& identity) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    --all_;
    const auto mine = by_identity_.find(identity);
    if (--mine->second == 0) by_identity_.erase(mine);
  }

  const int most_per_identity_, most_;
  Mutex mutex_;
  std::map<std::string, int> by_identity_ TS_GUARDED_BY(mutex_);
  int all_ TS_GUARDED_BY(mutex_) = 0;
};

/// One place while it lives, where there was one. The places outlive it.
class Place {
 public:
  Place(Places& places, std::string identity)
      : places_(places), identity_(std::move(identity)), held_(places.enter(identity_)) {}
  ~Place() {
    if (held_) places_.leave(identity_);
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  bool held() const { return held_; }

 private:
  Places& places_;
  const std::string identity_;
  const bool held_;
};

}  // namespace mbcosim::server
