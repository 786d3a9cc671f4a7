#include "service/eager_resume.h"

#include <spdlog/spdlog.h>

#include <set>

#include "service/durability.h"

namespace mbcosim::server {
namespace {

/// Whether there is room for more simulations, as far as refusals have told.
class Room {
 public:
  bool left_for(const std::string& owner) const { return !full_ && owners_.count(owner) == 0; }
  void learn(const Refusal& refusal, const std::string& owner) {
    if (refusal.limit() == "sessions") full_ = true;
    if (refusal.limit() == "identity_sessions") owners_.insert(owner);
  }

 private:
  bool full_ = false;
  std::set<std::string> owners_;  ///< who have as many as one identity may have
};

void tell(const std::string& name, const std::string& why) {
  spdlog::error("{} stays suspended: {}", name, printable(why));
}

}  // namespace

void EagerResume::start(const Parts& parts) {
  Simulations simulations = parts.durability.by_last_use();
  if (simulations.empty()) return;
  parts.runtime.lanes.post(Lane::heavy, "", [this, &parts, simulations = std::move(simulations)] {
    resume(parts, simulations);
  });
}

void EagerResume::resume(const Parts& parts, const Simulations& simulations) {
  Room room;
  std::size_t back = 0, gone = 0;
  for (const auto& [name, owner] : simulations) {
    if (call_.cancelled()) return;
    if (!room.left_for(owner)) continue;
    try {
      (void)parts.store.get(name, {owner, Role::control}, call_, Access::own);
      ++back;
    } catch (const Refusal& refusal) {
      if (call_.cancelled()) return;
      if (refusal.reason() == v1::REASON_NO_SUCH_SIMULATION) {
        ++gone;  // deleted meanwhile
        continue;
      }
      room.learn(refusal, owner);
      tell(name, reason_name(refusal.reason()) + ": " + refusal.what());
    } catch (const std::exception& error) {
      tell(name, error.what());
    }
  }
  const std::size_t left = simulations.size() - back - gone;
  spdlog::info("state folder: {} simulations are back{}", back,
               left > 0 ? ", " + std::to_string(left) + " stay suspended" : "");
}

}  // namespace mbcosim::server
