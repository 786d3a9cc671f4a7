#include "service/peer_places.h"

#include "wire/refusal.h"

namespace mbcosim::server {

void PeerPlaces::take(const std::string& identity) {
  Guard guard(mutex_);
  const int free = most_ - taken_;
  if (free <= 0)
    throw limit_refusal("shared_memory_peers", most_, "too many peers over shared memory");
  const auto known = own_.find(identity);
  const int own = known == own_.end() ? 0 : known->second;
  if (several_ && own >= free)
    throw limit_refusal("identity_shared_memory_peers", own,
                        identity + " has as many peers over shared memory as others could add");
  ++own_[identity];
  ++taken_;
}

void PeerPlaces::give_back(const std::string& identity) {
  Guard guard(mutex_);
  const auto own = own_.find(identity);
  if (--own->second == 0) own_.erase(own);
  --taken_;
}

}  // namespace mbcosim::server
