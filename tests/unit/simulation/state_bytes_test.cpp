#include "simulation/state_bytes.h"

#include <gtest/gtest.h>

#include <cstring>

#include "math/hash.h"

namespace mbcosim {
namespace {

constexpr std::size_t kVersionAt = 8;                // after the magic
constexpr std::size_t kFlagsAt = 8 + 4 + 8 + 4 * 8;  // version, digest, times and step

State some_state() {
  State state;
  state.time = 1.25;
  state.step = 7;
  state.y = state.yp = {1, 2, 3};
  state.kept_matrix = {4, 5};
  state.control = {.started = true,
                   .regular_steps = 6,
                   .last_iterations = 3,
                   .strategy = {.since_reduction = 5, .since_raise = 4, .last_chance = true},
                   .hope_odd = true,
                   .kept_iterations = 2,
                   .kept_coefficient = .125,
                   .kept_algebraic_coefficient = .25,
                   .exact_time = true,
                   .grid_start = .5,
                   .grid_step = .0625,
                   .grid_count = 12};
  return state;
}

/// The bytes with one of them changed and the checksum mended.
std::string changed(std::string bytes, std::size_t at, char value) {
  bytes[at] = value;
  bytes.resize(bytes.size() - sizeof(std::uint64_t));
  const std::uint64_t checksum = fnv1a(bytes);
  bytes.append(reinterpret_cast<const char*>(&checksum), sizeof checksum);
  return bytes;
}

TEST(StateBytes, HoldAllThatTheSolverRemembers) {
  const State state = some_state();
  const Result<State> read = state_from_bytes(state_to_bytes(state, 99), 99);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->kept_matrix, state.kept_matrix);
  EXPECT_TRUE(read->control == state.control);
}

TEST(StateBytes, OfAnOlderProgramAreRefusedByTheirVersion) {
  const std::string bytes = state_to_bytes(some_state(), 99);
  const Result<State> read = state_from_bytes(changed(bytes, kVersionAt, 1), 99);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::precondition);
  EXPECT_EQ(read.error().reason, "STATE_VERSION");
  EXPECT_EQ(read.error().message,
            "the state has format version 1; this program reads 2: it was saved by another "
            "version of mbcosim, start the run anew");
}

TEST(StateBytes, FlagsThatAreNeitherSetNorNotAreDamage) {
  const std::string bytes = state_to_bytes(some_state(), 99);
  ASSERT_EQ(bytes[kFlagsAt], 1);  // `started`
  const Result<State> read = state_from_bytes(changed(bytes, kFlagsAt, 2), 99);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::data_loss);
}

}  // namespace
}  // namespace mbcosim
