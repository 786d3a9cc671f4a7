/// A step after the first does not allocate on the heap.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <string>

#include "deck_run.h"

namespace {
std::atomic<long> allocations{0};

void* counted(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }

namespace mbcosim {
namespace {

/// Allocations of `steps` steps after a few others.
long allocations_of(const std::string& deck, int steps) {
  DeckRun run(deck);
  if (!run.ready()) return -1;
  run.step(5);
  const long before = allocations;
  const StepReport report = run.simulation().step_many(steps);
  const long during = allocations - before;
  EXPECT_FALSE(report.error);
  return during;
}

class Allocation : public testing::TestWithParam<const char*> {};

TEST_P(Allocation, TumblingBodyStepsWithout) {
  EXPECT_EQ(
      allocations_of(
          initial_value_block(
              1e-3, 1,
              "max iterations: 20; tolerance: 1e-9; method: ms, .6;" + std::string(GetParam())) +
              "begin: control data; structural nodes: 1; rigid bodies: 1; gravity; end: control "
              "data;"
              "begin: nodes; structural: 1, dynamic, null, eye, null, .01, 2., .01; end: nodes;"
              "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.;"
              " gravity: uniform, 0., 0., -1., const, 9.81; end: elements;",
          100),
      0);
}

INSTANTIATE_TEST_SUITE_P(Solvers, Allocation,
                         testing::Values("", "nonlinear solver: line search;",
                                         "nonlinear solver: newton raphson, modified, 3;"));

TEST(Allocation, BeamUnderAForceOnAPendulumStepsWithout) {
  EXPECT_EQ(
      allocations_of(
          initial_value_block(1e-3, 1,
                              "max iterations: 20; tolerance: 1e-6; derivatives tolerance: 1e-3;") +
              "begin: control data; structural nodes: 3; rigid bodies: 3; joints: 1; beams: 1; "
              "forces: 1;"
              " end: control data;"
              "begin: nodes; structural: 1, dynamic, null, eye, null, null;"
              " structural: 2, dynamic, .5,0.,0., eye, null, null;"
              " structural: 3, dynamic, 1.,0.,0., eye, null, null; end: nodes;"
              "begin: elements;"
              " body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye; body: 3, 3, 1., null, eye;"
              " joint: 1, revolute pin, 1, null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.,"
              "  null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;"
              " beam3: 1, 1, null, 2, null, 3, null, eye,"
              "  linear viscoelastic generic, diag, 1e6,1e6,1e6,1e3,1e3,1e3, proportional, 1e-3, "
              "same, same;"
              " force: 1, follower, 3, position, null, 0.,0.,1., sine, 0., 5., 10., forever, 0.;"
              "end: elements;",
          100),
      0);
}

/// Allocations of 100 steps of a discrete control of a process of first order; `card`: from the
/// order of B on.
long allocations_of_control(const std::string& card) {
  return allocations_of(
      initial_value_block(1e-3, 1, "max iterations: 20; tolerance: 1e-9;") +
          "begin: control data; abstract nodes: 2; genels: 2; electric elements: 1; end: "
          "control data; begin: nodes; abstract: 1; abstract: 2; end: nodes;"
          "begin: elements;"
          " genel: 1, spring support, 1, abstract, algebraic, linear elastic, 1.;"
          " genel: 2, state space SISO, 2, abstract, algebraic, node dof, 1, abstract,"
          "  algebraic, 1, matrix A, -2., matrix B, 1., matrix C, 3.;"
          " electric: 1, discrete control, 1, 1, 3, " +
          card +
          ", outputs, 2, abstract, algebraic, inputs, 1, abstract, algebraic;"
          "end: elements;",
      100);
}

TEST(Allocation, IdentificationStepsWithout) {
  EXPECT_EQ(
      allocations_of_control("2, identification, armax, forgetting factor, dynamic, 9, 3, .5, "
                             ".9, 1., .5, excitation, string, \"sin(1e5*Time^2)\""),
      0);
}

TEST(Allocation, AdaptiveControlStepsWithout) {
  EXPECT_EQ(
      allocations_of_control("1, adaptive control, armax, periodic, 2, gpc, 60, 40, 0, const, "
                             ".1, excitation, string, \"sin(1e5*Time^2)\", desired output, "
                             "const, 1."),
      0);
}

// The clamp lets go in the fourth step: from then on matrices are of another kind than at the
// start.
TEST(Allocation, ReleasedBodyStepsWithout) {
  EXPECT_EQ(allocations_of(
                initial_value_block(1e-3, 1, "max iterations: 20; tolerance: 1e-9;") +
                    "begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity;"
                    " end: control data;"
                    "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;"
                    "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.;"
                    " driven: 1, string, \"Time < .0035\", joint: 1, clamp, 1, node, node;"
                    " gravity: uniform, 0., 0., -1., const, 9.81; end: elements;",
                100),
            0);
}

}  // namespace
}  // namespace mbcosim
