/// The tutorials' chain of five beams, unrolled by repeated includes with a counter and written
/// with a loop.
#include <gtest/gtest.h>

#include "deck_run.h"
#include "model/model.h"
#include "simulation/describe.h"

namespace mbcosim::loop_model_test {
namespace {

const char* const kNodes =
    "structural: curr_elem, dynamic, (curr_elem - 1)*dL, 0., 0., eye, null, null;\n"
    "structural: curr_elem + 1, dynamic, curr_elem*dL, 0., 0., eye, null, null;\n";
const char* const kElements =
    "set: real half = dL/2.;\n"
    "body: curr_elem, curr_elem, half*m, null, diag, half*j, half^3*m/12., half^3*m/12.;\n"
    "body: curr_elem + 1, curr_elem + 1, half*m, null, diag, half*j, half^3*m/12., half^3*m/12.;\n"
    "beam3: curr_elem, curr_elem - 1, null, curr_elem, null, curr_elem + 1, null, eye,\n"
    "  linear elastic generic, diag, 1.e9, 1.e9, 1.e9, 1.e4, 1.e4, 1.e5, same, same;\n";

std::map<std::string, std::string> deck(const std::string& before, const std::string& nodes,
                                        const std::string& elements) {
  std::string beam_elements = kElements;
  if (!before.empty()) beam_elements.replace(0, std::string("set: real half").size(), "set: half");
  return {
      {"beam.nod", kNodes},
      {"beam.elm", beam_elements},
      {"deck.mbd",
       "set: integer N = 5; set: real L = .5; set: real dL = L/N; set: real m = 1.; set: real j = "
       "1.e-2;\n" +
           before +
           "begin: data; problem: initial value; end: data;\n"
           "begin: initial value; time step: 1.e-3; final time: 1.; method: ms, .6; tolerance: "
           "1.e-5; "
           "max iterations: 10; end: initial value;\n"
           "begin: control data; structural nodes: 2*N + 1; rigid bodies: 2*N; beams: N; joints: "
           "1; "
           "forces: 1; end: control data;\n"
           "begin: nodes; structural: 1, static, null, eye, null, null;\n" +
           nodes + "end: nodes;\nbegin: elements; joint: 1, clamp, 1, node, node;\n" + elements +
           "force: 2*N + 1, follower, 2*N + 1, position, null, 0., 0., 1., cosine, 0., pi/2., 10., "
           "half, 0.;\nend: elements;\n"}};
}

std::map<std::string, std::string> with_loops() {
  const auto loop = [](const char* file) {
    return "for: integer curr_elem = 2, 2*N, 2; include: \"" + std::string(file) + "\"; end for;\n";
  };
  return deck("", loop("beam.nod"), loop("beam.elm"));
}

std::map<std::string, std::string> unrolled() {
  const auto repeat = [](const std::string& file) {
    std::string text = "set: curr_elem = 2;\n";
    for (int k = 0; k < 5; ++k)
      text += "include: \"" + file + "\";\nset: curr_elem = curr_elem + 2;\n";
    return text;
  };
  return deck("set: integer curr_elem; set: real half;\n", repeat("beam.nod"), repeat("beam.elm"));
}

/// Nodes, elements and their variables; not the symbols, which differ.
std::string entities(const DeckRun& run) {
  ModelDescription d = describe(run.model());
  d.digest.clear();
  d.symbols.clear();
  return to_json(d);
}

TEST(LoopCantilever, IsTheModelOfTheUnrolledDeck) {
  DeckRun loop(with_loops()), plain(unrolled());
  ASSERT_TRUE(loop.ready() && plain.ready());
  EXPECT_EQ(entities(loop), entities(plain));
  loop.step(5);
  plain.step(5);
  EXPECT_EQ(loop.simulation().state().y, plain.simulation().state().y);
  EXPECT_NE(loop.node(11).x(2), 0);
}

TEST(LoopCantilever, HasTheChainOfTheTutorial) {
  DeckRun run(with_loops());
  ASSERT_TRUE(run.ready());
  const Model& model = run.model();
  ASSERT_EQ(model.structural.size(), 11u);
  for (int k = 0; k < 11; ++k) {
    EXPECT_EQ(model.structural[k].label, k + 1);
    EXPECT_NEAR(model.structural[k].x(0), .1 * k, 1e-15);
  }
  for (int k = 2; k <= 11; ++k) EXPECT_NEAR(run.datum(Family::body, k, "m"), .05, 1e-16);
  for (int k = 2; k <= 10; k += 2) {
    const ElementRef beam = model.find_element(Family::beam, k);
    ASSERT_TRUE(beam.set);
    const auto nodes = beam.set->nodes(beam.index);
    ASSERT_EQ(nodes.size(), 3u);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(model.structural[nodes[i]].label, k - 1 + i);
  }
}

}  // namespace
}  // namespace mbcosim::loop_model_test
