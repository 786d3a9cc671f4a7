/// What the files of Durability share.
#pragma once

#include <string>

#include "durable/state_folder.h"
#include "wire/refusal.h"

namespace mbcosim::server {

inline const std::string kSimulations = "simulations/";  ///< begins the name of each

/// Name of a simulation's folder.
inline std::string id_of(const std::string& simulation) {
  return simulation.substr(kSimulations.size());
}

[[noreturn]] inline void refuse_storage(const std::string& what, const StorageError& error) {
  throw Refusal(v1::REASON_STORAGE_FULL, what + ": " + error.what());
}

/// All of what `write` puts into the folder of a new simulation, or nothing is left. Throws
/// STORAGE_FULL.
template <class Write>
void store_new(StateFolder& folder, const std::string& id, Write write) {
  try {
    folder.start(id);
    write();
    folder.finish(id);
  } catch (const StorageError& error) {
    folder.remove(id);
    refuse_storage("the simulation cannot be stored", error);
  } catch (...) {
    folder.remove(id);
    throw;
  }
}

}  // namespace mbcosim::server
