/// Methods of `mbcosim.v1.Simulations`: convert, call the session, convert back.
#pragma once

#include "service/parts.h"

namespace mbcosim::server {

/// Adds all of them to the gate. `parts` outlives it.
void add_simulations(Gate& gate, const Parts& parts);

// In parts, each in a file of its own.
void add_creation(Gate& gate, const Parts& parts);
void add_stepping(Gate& gate, const Parts& parts);
void add_snapshots(Gate& gate, const Parts& parts);
void add_checkpoints(Gate& gate, const Parts& parts);

inline std::string simulations_path(const char* method) {
  return std::string("/mbcosim.v1.Simulations/") + method;
}

constexpr std::size_t kChunkBytes = 1 << 20;  ///< of one message of a series of pieces

}  // namespace mbcosim::server
