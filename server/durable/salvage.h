/// What can be had of a stored simulation of which something is damaged.
#pragma once

#include <string>
#include <vector>

#include "mbcosim/v1/checkpoints.pb.h"

namespace mbcosim::server {

struct Salvage {
  std::string bytes;                  ///< for ImportCheckpoint
  v1::SimulationInfo info;            ///< where it stands
  std::vector<std::string> left_out;  ///< files and parts of files, each with its damage
};

/// Of a folder DIR/simulations/ID of a state folder, or of one that was put aside: the last
/// checkpoint and what the journal tells of later, up to the first damage, and the snapshots that
/// are whole. Nothing in the folder is changed. Throws StorageError when the model or the last
/// checkpoint cannot be read.
Salvage salvage(const std::string& folder);

}  // namespace mbcosim::server
