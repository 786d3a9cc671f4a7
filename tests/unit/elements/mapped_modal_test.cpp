/// Modes that nodes follow by a matrix: loads of the peer keep virtual work, the matrix is the
/// derivative, the card says what it cannot take.
#include "elements/ports/mapped_modal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deck_run.h"
#include "elements/conformance.h"

namespace mbcosim::mapped_modal_test {
namespace {

struct Form {
  const char* name;
  bool reference, rigid, rotate;
};

class MappedModes : public testing::TestWithParam<Form> {
 protected:
  static constexpr int kModes = 3;

  void build() {
    const Form& form = GetParam();
    MappedModal::Settings s;
    s.nodes = {bench_.first, bench_.second};
    if (form.reference) s.reference = bench_.add_node(StructuralKind::static_);
    s.rotate_rigid_loads = form.rotate;
    MatX H(kModes, 12);
    for (Eigen::Index k = 0; k < H.size(); ++k) H(k) = bench_.number();
    s.H = H.sparseView();
    ElementPort port;
    port.kind = ElementPort::Kind::modal;
    port.name = "p";
    if (form.rigid) port.nodes = {s.reference};
    port.mode_numbers = {1, 2, 3};
    port.input_size = kModes + (form.rigid ? 6 : 0);
    port.output_size = 2 * kModes;
    port.memory = memory_ = bench_.builder.allocate_memory(port.input_size);
    reference_ = s.reference;
    ElementInfo info;
    info.label = 1;
    auto element = std::make_unique<MappedModal>(port, s, bench_.builder.model(),
                                                 bench_.builder.input_context());
    add_general_element(bench_.builder, info, std::move(element));
    bench_.finish();
    bench_.generic_state(0.3);
    for (int k = 0; k < port.input_size; ++k) bench_.state.memory[memory_ + k] = bench_.number();
  }
  Vec3 input(int first) const { return Vec3(&bench_.state.memory[memory_ + first]); }
  /// Power of all loads on the nodes.
  double power() const {
    const VecX r = bench_.residual(bench_.state);
    double sum = 0;
    for (const StructuralNode& n : bench_.model->structural) {
      const NodeState s = bench_.model->node_state(
          bench_.context(bench_.state), static_cast<int>(&n - bench_.model->structural.data()));
      sum += r.segment<3>(n.first).dot(s.v) + r.segment<3>(n.first + 3).dot(s.w);
    }
    return sum;
  }
  /// q, then q̇.
  std::vector<double> modes() const {
    std::vector<double> out;
    port_elements(*bench_.model).front().outputs(bench_.context(bench_.state), out);
    return out;
  }
  conformance::Bench bench_;
  int memory_ = 0, reference_ = -1;
};

TEST_P(MappedModes, JacobianMatchesCentralDifferences) {
  build();
  const MatX J = bench_.jacobian();
  if (GetParam().reference) {
    EXPECT_GT(J.norm(), 1e-4);
  }
  conformance::expect_near(bench_, J, bench_.numerical_jacobian(), 1e-7);
}

TEST_P(MappedModes, LoadsKeepVirtualWork) {
  build();
  const std::vector<double> q = modes();
  ASSERT_EQ(q.size(), 2u * kModes);
  double expected = 0;
  const int first = GetParam().rigid ? 6 : 0;
  for (int k = 0; k < kModes; ++k)
    expected += bench_.state.memory[memory_ + first + k] * q[kModes + k];
  if (GetParam().reference) {
    const NodeState r = bench_.model->node_state(bench_.context(bench_.state), reference_);
    if (GetParam().rigid) {
      const Mat3 turn = GetParam().rotate ? r.R : Mat3(Mat3::Identity());
      expected += (turn * input(0)).dot(r.v) + (turn * input(3)).dot(r.w);
    } else {
      return;  // loads on the nodes alone move the reference node, too
    }
  }
  EXPECT_NEAR(power(), expected, 1e-12);
}

constexpr const char* kDeck = R"(begin: data; problem: initial value; end: data;
begin: initial value; final time: 1e-3; time step: 1e-3; end: initial value;
begin: control data; end: control data;
begin: nodes; structural: 1, dynamic, 1.,0.,0., eye, 0.,2.,0., null;
  structural: 2, dynamic, 0.,1.,0., eye, null, 0.,0.,3.; end: nodes;
begin: elements; body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;
  force: 7, external modal mapping, grpc, port, "modes", $OPTIONS;
end: elements;
)";

LoadReport load(const std::string& options, const std::string& matrix) {
  std::string text = kDeck;
  text.replace(text.find("$OPTIONS"), 8, options);
  return load_deck(
      BundleSource(std::map<std::string, std::string>{{"deck.mbd", text}, {"H", matrix}}),
      "deck.mbd");
}

std::string first_error(const LoadReport& report) {
  for (const Diagnostic& d : report.diagnostics)
    if (d.severity == Severity::error) return d.message;
  return "";
}

TEST(MappedModesCard, ReadsSparseAndFullMatrices) {
  const std::string sparse = "# rows\n1 2 .5\n2 12 2.\n2 1 1e-12\n",
                    full = "0 .5 0 0 0 0 0 0 0 0 0 0\n0 0 0 0 0 0 0 0 0 0 0 2.\n";
  for (const std::string& card :
       {std::string("nodes number, 2, 1, 2, modes number, 2, sparse mapping file, threshold, 1e-9, "
                    "\"H\""),
        std::string("type, modal, nodes number, 2, 1, 2, modes number, from file, full mapping "
                    "file, \"H\"")}) {
    const LoadReport report = load(card, card.find("sparse") != card.npos ? sparse : full);
    ASSERT_TRUE(report.ok()) << first_error(report);
    auto simulation = Simulation::create(report.model);
    ASSERT_TRUE(simulation);
    std::vector<double> modes;
    port_elements(*report.model)
        .front()
        .outputs(report.model->context((*simulation)->state(), Phase::step), modes);
    ASSERT_EQ(modes.size(), 4u);
    EXPECT_NEAR(modes[0], 0, 1e-12);
    EXPECT_NEAR(modes[2], 1, 1e-12);  // half of node 1's velocity along axis 2
    EXPECT_NEAR(modes[3], 6, 1e-12);  // twice node 2's angular velocity about axis 3
  }
}

TEST(MappedModesCard, SaysWhatItCannotTake) {
  using testing::HasSubstr;
  const std::string nodes = "nodes number, 2, 1, 2, ", one = "1 1 1.\n";
  EXPECT_THAT(
      first_error(load("type, all, " + nodes + "modes number, 1, sparse mapping file, \"H\"", one)),
      HasSubstr("rigid motion is that of a `reference node`, which is missing"));
  EXPECT_THAT(
      first_error(load("nodes number, 2, 1, 1, modes number, 1, sparse mapping file, \"H\"", one)),
      HasSubstr("structural node 1 is listed twice"));
  EXPECT_THAT(first_error(load(nodes + "modes number, 1, full mapping file, \"H\"", "1. 2.\n")),
              HasSubstr("the matrix must be 1 by 12, found 2 numbers"));
  EXPECT_THAT(
      first_error(load(nodes + "modes number, from file, full mapping file, \"H\"", "1. 2.\n")),
      HasSubstr("2 numbers do not fill rows of 12"));
  EXPECT_THAT(first_error(load(nodes + "modes number, 1, sparse mapping file, \"H\"", "1 13 1.\n")),
              HasSubstr("entry 1 lies outside of 1 by 12"));
  EXPECT_THAT(first_error(load(nodes + "modes number, 1, sparse mapping file, \"H\"", "1 1 nan\n")),
              HasSubstr("\"nan\" is no number"));
  EXPECT_THAT(first_error(load(nodes + "modes number, -1, sparse mapping file, \"H\"", one)),
              HasSubstr("the number of modes must be from 1 to"));
}

INSTANTIATE_TEST_SUITE_P(Forms, MappedModes,
                         testing::Values(Form{"Global", false, false, false},
                                         Form{"Relative", true, false, false},
                                         Form{"Rigid", true, true, true},
                                         Form{"RigidUnturned", true, true, false}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbcosim::mapped_modal_test
