// Every element type that a deck can name, by its name: its matrix against central differences of
// its residual. A word without a card fails a test.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <string>

#include "input/word_cards.h"
#include "jacobian_check.h"
#include "model/registry.h"
#include "simulation/simulation.h"
#include "solver/stages.h"
#include "solver/system.h"

namespace mbcosim::registered_elements_test {
namespace {

/// Nothing that they add to the equations depends on the state; of peers there is none here, their
/// loads are zero.
const std::set<std::string> kConstant = {"automatic structural",
                                         "couple: absolute",
                                         "couple: absolute internal",
                                         "couple: conservative",
                                         "couple: conservative internal",
                                         "electric: discrete control",
                                         "force: absolute displacement",
                                         "force: absolute internal displacement",
                                         "force: abstract",
                                         "force: abstract internal",
                                         "force: external structural",
                                         "RTAI output",
                                         "force: external modal mapping",
                                         "force: external structural mapping",
                                         "output element: socket stream",
                                         "output element: stream",
                                         "stream motion output",
                                         "stream output",
                                         "thermal: source"};

ModelPtr read(const decks::WordCard& card) {
  const LoadReport report =
      load_deck(BundleSource(word_deck(card, decks::Bench::bare)), "deck.mbd");
  for (const Diagnostic& d : report.diagnostics) EXPECT_NE(d.severity, Severity::error) << d.text();
  return report.model;
}

class RegisteredElement : public testing::TestWithParam<decks::WordCard> {
 protected:
  static constexpr double kC = .02;

  /// Everything moved from the start by something like a percent of its size.
  State general_state(const Model& model) {
    State state = make_initial_state(model);
    for (int i = 0; i < model.unknowns; ++i) {
      state.y[i] += .02 * number() * std::max(1e-2, std::abs(state.y[i]));
      state.yp[i] += .1 * number();
    }
    for (NodeRotationHistory& r : state.rotation_history) {
      r.R_ref = rotation_of_vector<double>(Vec3(number(), number(), number())) * r.R_ref;
      r.w_ref += Vec3(number(), number(), number());
    }
    state.time = .5;
    state.step = 1;
    state.h = state.h_previous = 1e-3;
    update_rotations(model, state);
    const EvalContext predicted = model.context(state, Phase::step, kC, kC);
    Scratch scratch(model.scratch);
    run_after_prediction(predicted, scratch, state);
    return state;
  }
  double number() { return number_(generator_); }
  MatX matrix(const Model& model, const State& state) const {
    Workspace workspace(model);
    compute_jacobian(model.context(state, Phase::step, kC, kC), workspace);
    return model.dense(workspace.values);
  }
  static VecX residual(const Model& model, const State& state) {
    Scratch scratch(model.scratch);
    std::vector<double> r(model.unknowns);
    compute_residual(model.context(state, Phase::step, kC, kC), scratch, r);
    return Eigen::Map<const VecX>(r.data(), model.unknowns);
  }
  static VecX moved(const Model& model, State state, int column, double step) {
    std::vector<double> delta(model.unknowns, 0.0);
    delta[column] = step;
    apply_correction(model, delta, kC, kC, state);
    return residual(model, state);
  }
  /// A step of an unknown that moves its value by 1e-5 of its size.
  static double step_of(const Model& model, const State& state, int column) {
    const double size = 1e-5 * std::max(1., std::abs(state.y[column]));
    return model.kinds[column] == UnknownKind::differential ? size / kC : size;
  }

  std::mt19937 generator_{5};
  std::uniform_real_distribution<double> number_{-1, 1};
};

TEST_P(RegisteredElement, MatrixHoldsTheDerivativesOfTheResidual) {
  const ModelPtr model = read(GetParam());
  ASSERT_NE(model, nullptr);
  const State state = general_state(*model);
  const MatX J = matrix(*model, state);
  const auto step = [&](int column) { return step_of(*model, state, column); };
  const MatX D = central_differences(model->unknowns, step, [&](int column, double delta) {
    return moved(*model, state, column, delta);
  });
  // Rounding of residuals: what their terms are, by the matrix.
  const VecX terms =
      J.cwiseAbs() *
      (Eigen::Map<const VecX>(state.y.data(), J.cols()).cwiseAbs() / kC + VecX::Ones(J.cols()));
  for (int i = 0; i < J.rows(); ++i)
    for (int j = 0; j < J.cols(); ++j)
      EXPECT_LE(std::abs(J(i, j) - D(i, j)),
                1e-6 * std::max(std::abs(D(i, j)), 1e-3 * D.row(i).cwiseAbs().maxCoeff()) +
                    1e-14 * terms(i) / step(j))
          << GetParam().word << ": " << model->row_text(i).first << ", "
          << model->row_text(i).second << ", column " << j << " (" << model->row_text(j).first
          << "): " << J(i, j) << " against " << D(i, j);
}

TEST_P(RegisteredElement, HasAMatrixUnlessItIsKnownForNone) {
  const ModelPtr model = read(GetParam());
  ASSERT_NE(model, nullptr);
  const State state = general_state(*model);
  const std::vector<NodeSeeds> seeds(model->structural.size(),
                                     NodeSeeds{kC * Mat3::Identity(), Mat3::Identity()});
  const MatX J = matrix_of_elements(model->context(state, Phase::step, kC, kC), seeds);
  EXPECT_EQ(J.isZero(0), kConstant.count(GetParam().word) > 0) << GetParam().word;
}

/// On which it rests that elements can be evaluated at the same time.
TEST_P(RegisteredElement, AddsToNoRowsButThoseItTells) {
  const ModelPtr model = read(GetParam());
  ASSERT_NE(model, nullptr);
  const State state = general_state(*model);
  Scratch scratch(model->scratch);
  EvalContext context = model->context(state, Phase::step, kC, kC);
  context.scratch = &scratch;
  accumulate(context);
  std::vector<NodeSeeds> seeds(model->structural.size());
  compute_seeds(context, seeds);
  for (const ElementRef& e : model->elements) {
    std::vector<int> rows;
    e.set->append_rows(*model, e.index, rows);
    const auto tells = [&](int row) { return std::count(rows.begin(), rows.end(), row) > 0; };
    std::vector<double> r(model->unknowns, 0.0), values(model->row_index.size(), 0.0);
    e.set->residual(context, r.data(), {e.index, e.index + 1});
    e.set->jacobian(context, seeds.data(), values.data(), {e.index, e.index + 1});
    for (int row = 0; row < model->unknowns; ++row)
      EXPECT_TRUE(r[row] == 0 || tells(row)) << GetParam().word << ", row " << row;
    for (std::size_t k = 0; k < values.size(); ++k)
      EXPECT_TRUE(values[k] == 0 || tells(model->row_index[k]))
          << GetParam().word << ", row " << model->row_index[k];
  }
}

INSTANTIATE_TEST_SUITE_P(Named, RegisteredElement, testing::ValuesIn(decks::element_cards()),
                         [](const auto& info) { return decks::test_name(info.param); });

TEST(RegisteredWords, AreAllHeldByName) {
  std::set<std::string> held;
  for (const decks::WordCard& c : decks::word_cards()) held.insert(normalized(c.word));
  const std::set<std::string> wanted = decks::registered_words();
  for (const std::string& word : wanted)
    EXPECT_EQ(held.count(word), 1u) << "no card for \"" << word
                                    << "\": add one to the tests' "
                                       "input/element_cards.cpp, law_cards.cpp or object_cards.cpp";
  for (const std::string& word : held)
    EXPECT_EQ(wanted.count(word), 1u) << "\"" << word << "\" is no word of a deck";
}

}  // namespace
}  // namespace mbcosim::registered_elements_test
