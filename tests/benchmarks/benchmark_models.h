/// Decks of a chosen size, as text, and simulations.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "simulation/simulation.h"

namespace mbcosim::benchmarks {

using Bundle =
    std::map<std::string, std::string>;  ///< file name -> contents; the deck is "deck.mbd"

/// Rigid links of 1 m hanging from a spherical pin, joined by spherical hinges, released
/// horizontally.
Bundle rigid_chain(int links);
/// Cantilever of three-node beams with a follower force at the tip.
Bundle cantilever(int elements);
/// A modal body with `modes` modes, clamped at one interface node and driven by its spin.
Bundle modal_body(int modes);

/// Of the cantilever of so many elements or of a deck's file; null where it is refused or fails.
std::unique_ptr<Simulation> after_three_steps(const std::string& model);

}  // namespace mbcosim::benchmarks
