/// Snapshots that continue bit for bit.
#pragma once

#include <gtest/gtest.h>

#include "deck_run.h"
#include "simulation/state_bytes.h"

namespace mbcosim {

/// From a snapshot after `before` steps, the same simulation and another one of the same deck,
/// which reads the snapshot's bytes, come to the bits that the first came to after `ahead` more
/// steps.
template <class Deck>
void expect_restored_runs_continue(const Deck& deck, int before, int ahead) {
  DeckRun run(deck), other(deck);
  ASSERT_TRUE(run.ready() && other.ready());
  run.step(before);
  const State saved = run.simulation().snapshot();
  const std::string bytes = state_to_bytes(saved, run.model().digest);
  run.step(ahead);
  const State expected = run.simulation().snapshot();
  ASSERT_TRUE(run.simulation().restore(saved));
  run.step(ahead);
  EXPECT_EQ(run.simulation().state().y, expected.y);
  EXPECT_EQ(run.simulation().state().memory, expected.memory);
  const Result<State> read = state_from_bytes(bytes, other.model().digest);
  ASSERT_TRUE(read);
  ASSERT_TRUE(other.simulation().restore(*read));
  other.step(ahead);
  EXPECT_EQ(other.simulation().state().y, expected.y);
  EXPECT_EQ(other.simulation().state().memory, expected.memory);
}

}  // namespace mbcosim
