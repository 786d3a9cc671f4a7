#include "simulation/state_bytes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>

#include "deck_run.h"
#include "math/hash.h"

namespace mbcosim::state_bytes_test {
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

/// A state in which no two numbers are alike.
State numbered_state(int unknowns, int nodes) {
  State state = some_state();
  double number = 0;
  state.h = ++number;
  state.h_previous = ++number;
  for (const auto array : kStateArrays) {
    (state.*array).resize(unknowns++);
    for (double& x : state.*array) x = ++number;
  }
  const auto fill = [&](auto&... parts) {
    (parts.setConstant(1), ...);
    ((parts *= ++number), ...);
  };
  for (int k = 0; k < nodes; ++k) {
    NodeRotation& q = state.rotation.emplace_back();
    NodeRotationHistory& past = state.rotation_history.emplace_back();
    fill(q.R, q.w, past.R_ref, past.R1, past.R2, past.w_ref, past.w1, past.w2);
  }
  return state;
}

/// Into an empty state, one with other numbers and larger and smaller ones.
TEST(StateBytes, AreThoseOfACopyByThreads) {
  const State state = numbered_state(20, 7);
  const std::string expected = state_to_bytes(state, 99);
  for (const int threads : {1, 2, 3}) {
    ThreadTeam team(threads);
    for (State copy :
         {State(), numbered_state(20, 7), numbered_state(3, 1), numbered_state(40, 9)}) {
      copy_state(state, copy, &team);
      EXPECT_TRUE(state_to_bytes(copy, 99) == expected) << threads;
    }
  }
  State copy;
  copy_state(state, copy, nullptr);
  EXPECT_TRUE(state_to_bytes(copy, 99) == expected);
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

TEST(StateBytes, OfCountsAndTimesFromWhichNoStepCanGoOnAreDamage) {
  const auto reason = [](const std::function<void(State&)>& change) {
    State state = some_state();
    change(state);
    const Result<State> read = state_from_bytes(state_to_bytes(state, 99), 99);
    return read ? "" : read.error().reason;
  };
  EXPECT_EQ(reason([](State&) {}), "");
  EXPECT_EQ(reason([](State& s) { s.step = INT64_MAX; }), "STATE_DAMAGED");
  EXPECT_EQ(reason([](State& s) { s.step = -1; }), "STATE_DAMAGED");
  EXPECT_EQ(reason([](State& s) { s.control.grid_count = INT64_MAX; }), "STATE_DAMAGED");
  EXPECT_EQ(reason([](State& s) { s.control.strategy.since_raise = -7; }), "STATE_DAMAGED");
  EXPECT_EQ(reason([](State& s) { s.time = HUGE_VAL; }), "STATE_DAMAGED");
  EXPECT_EQ(reason([](State& s) { s.h = NAN; }), "STATE_DAMAGED");
}

/// A checksum anybody can compute: what a step reads must be there whoever made the state.
TEST(StateBytes, WithAnArrayOfAnotherLengthDoNotBecomeTheState) {
  DeckRun run(
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; initial time: 0.; final time: 1.; time step: .1; tolerance: 1e-9; "
      "max iterations: 10; end: initial value;\n"
      "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;\n"
      "begin: nodes; structural: 1, dynamic, null, eye, 1., 0., 0., null; end: nodes;\n"
      "begin: elements; body: 1, 1, 2., null, eye; end: elements;\n");
  ASSERT_TRUE(run.ready());
  run.step(2);
  const State own = run.simulation().snapshot();
  const std::uint64_t digest = run.model().digest;
  const auto imported = [&](const std::function<void(State&)>& change) {
    State state = own;
    change(state);
    const Status status = run.simulation().import_state(state_to_bytes(state, digest));
    return status ? "" : status.error().reason;
  };
  for (const auto array : {&State::y, &State::yp, &State::y1, &State::yp1, &State::y2, &State::yp2,
                           &State::memory, &State::variables, &State::kept_matrix}) {
    EXPECT_EQ(imported([&](State& s) { (s.*array).push_back(1); }), "STATE_OF_ANOTHER_MODEL");
    if ((own.*array).empty()) continue;
    EXPECT_EQ(imported([&](State& s) { (s.*array).pop_back(); }), "STATE_OF_ANOTHER_MODEL");
  }
  EXPECT_EQ(imported([](State& s) { s.external_loads = {1}; }), "STATE_OF_ANOTHER_MODEL");
  EXPECT_EQ(imported([](State& s) { s.rotation.clear(); }), "STATE_OF_ANOTHER_MODEL");
  EXPECT_EQ(imported([](State& s) { s.external_loads.assign(6, 1.5); }), "");
  run.step();
}

}  // namespace
}  // namespace mbcosim::state_bytes_test
