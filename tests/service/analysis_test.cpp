#include "service/analysis.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>

#include "deck_simulation.h"
#include "wire/refusal.h"

namespace mbcosim::server::analysis_test {
namespace {

using Complex = std::complex<double>;
using google::protobuf::util::MessageDifferencer;

constexpr double kMass = 2, kDamping = 8, kStiffness[] = {800, 1800, 3200};

/// kMass between springs to the ground along x (damped), y and z.
std::unique_ptr<Simulation> mass_between_springs() {
  return simulation_of(
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; initial time: 0.; final time: 1.; time step: .125; method: ms, 1.; "
      "tolerance: 1e-9; max iterations: 10; derivatives tolerance: 1e-3; end: initial value;\n"
      "begin: control data; structural nodes: 1; rigid bodies: 1; genels: 3; end: control data;\n"
      "begin: nodes; structural: 1, dynamic displacement, .5, .25, .125, null; end: nodes;\n"
      "begin: elements; body: 1, 1, 2.;\n"
      "genel: 1, spring support, 1, structural, 1, algebraic, linear viscoelastic, 800., 8.;\n"
      "genel: 2, spring support, 1, structural, 2, algebraic, linear elastic, 1800.;\n"
      "genel: 3, spring support, 1, structural, 3, algebraic, linear elastic, 3200.;\n"
      "end: elements;\n");
}

/// m s² + c s + k along an axis.
Complex characteristic(Complex s, int axis) {
  return kMass * s * s + (axis == 0 ? kDamping : 0) * s + kStiffness[axis];
}

MatX matrix(const v1::Matrix& from) {
  MatX to = MatX::Zero(from.rows(), from.columns());
  for (int k = 0; k < from.values_size(); ++k)
    if (from.sparse())
      to(from.row_indices(k), from.column_indices(k)) = from.values(k);
    else
      to(k / from.columns(), k % from.columns()) = from.values(k);
  return to;
}

class Analysed : public testing::Test {
 protected:
  Analysed() {
    linearize_.add_inputs(handle("node.structural.1.load"));
    linearize_.add_outputs(handle("node.structural.1.X"));
  }
  int handle(const char* name) const { return simulation_->find_variable(name); }
  Analysis::TakeState take_state() {
    return [this](std::int64_t* step) {
      ++states_taken_;
      *step = simulation_->step_number();
      return simulation_->snapshot();
    };
  }
  v1::LinearizeReply answer(const v1::LinearizeRequest& request) {
    v1::LinearizeReply reply;
    analysis_.linearize(request, take_state(), call_, &reply);
    return reply;
  }
  v1::ComputeEigenvaluesReply answer(const v1::ComputeEigenvaluesRequest& request) {
    v1::ComputeEigenvaluesReply reply;
    analysis_.eigenvalues(request, take_state(), call_, &reply);
    return reply;
  }
  template <class Request>
  v1::Reason refusal(const Request& request) {
    try {
      answer(request);
    } catch (const Refusal& refusal) {
      return refusal.reason();
    }
    return v1::REASON_UNSPECIFIED;
  }
  /// All pages; `pages`: how many.
  template <class Request>
  auto joined(Request request, int* pages) {
    auto all = answer(request);
    for (*pages = 1; !all.next_page_token().empty(); ++*pages) {
      request.set_page_token(all.next_page_token());
      const auto page = answer(request);
      const auto join = [](v1::Matrix* to, const v1::Matrix& from) {
        if (from.rows() == 0) return;
        EXPECT_TRUE(to->rows() == 0 || to->rows() == from.rows());
        to->MergeFrom(from);
      };
      if constexpr (std::is_same_v<Request, v1::LinearizeRequest>) {
        join(all.mutable_a(), page.a());
        join(all.mutable_b(), page.b());
        join(all.mutable_c(), page.c());
        join(all.mutable_d(), page.d());
        join(all.mutable_e(), page.e());
        all.mutable_state_names()->MergeFrom(page.state_names());
      } else {
        all.mutable_real()->MergeFrom(page.real());
        all.mutable_imaginary()->MergeFrom(page.imaginary());
        join(all.mutable_vectors_real(), page.vectors_real());
        join(all.mutable_vectors_imaginary(), page.vectors_imaginary());
      }
      EXPECT_EQ(page.step(), all.step());
      all.set_next_page_token(page.next_page_token());
    }
    return all;
  }

  const std::unique_ptr<Simulation> simulation_ = mass_between_springs();
  const VariableAccess variables_{simulation_->variables()};
  MemoryBudget memory_{1 << 30};
  Analysis analysis_{simulation_->model(), variables_, memory_};
  Call call_;
  int states_taken_ = 0;
  v1::LinearizeRequest linearize_;
  v1::ComputeEigenvaluesRequest eigenvalues_;
};

// Whoever imports a state may have made it.
TEST(Analysis, OfAStateThatCannotBeEvaluatedIsRefused) {
  const auto simulation = simulation_of(
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; initial time: 0.; final time: 1.; time step: .125; method: ms, 1.; "
      "tolerance: 1e-9; max iterations: 10; derivatives tolerance: 1e-3; end: initial value;\n"
      "begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; end: control data;\n"
      "begin: nodes; structural: 1, dynamic displacement, null, null; end: nodes;\n"
      "begin: elements; body: 1, 1, 2.;\n"
      "force: 1, absolute displacement, 1, 1., 0., 0., string, \"sqrt(2. - Time)\";\n"
      "end: elements;\n");
  const VariableAccess variables{simulation->variables()};
  MemoryBudget memory{1 << 30};
  Analysis analysis{simulation->model(), variables, memory};
  Call call;
  const auto late = [&](std::int64_t*) {
    State state = simulation->snapshot();
    state.time = 3;
    return state;
  };
  v1::LinearizeReply linear;
  v1::ComputeEigenvaluesReply spectrum;
  const auto reason = [](auto&& ask) {
    try {
      ask();
    } catch (const Refusal& refusal) {
      return refusal.reason();
    }
    return v1::REASON_UNSPECIFIED;
  };
  EXPECT_EQ(reason([&] { analysis.linearize({}, late, call, &linear); }), v1::REASON_EVALUATION);
  EXPECT_EQ(reason([&] { analysis.eigenvalues({}, late, call, &spectrum); }),
            v1::REASON_EVALUATION);
}

TEST_F(Analysed, StateSpaceHasTheTransferFunctionsOfTheSprings) {
  linearize_.add_outputs(handle("node.structural.1.XP"));
  const v1::LinearizeReply reply = answer(linearize_);
  const MatX a = matrix(reply.a()), b = matrix(reply.b()), c = matrix(reply.c()),
             d = matrix(reply.d());
  ASSERT_EQ(a.rows(), 6);
  ASSERT_EQ(c.rows(), 6);
  EXPECT_THAT(reply.state_names(), testing::ElementsAre("z1", "z2", "z3", "z4", "z5", "z6"));
  EXPECT_EQ(reply.step(), 0);
  for (const double w : {0., 3., 25., 300.}) {
    const Complex s(0, w);
    const Eigen::MatrixXcd response = c * (s * Eigen::MatrixXcd::Identity(6, 6) - a)
                                              .partialPivLu()
                                              .solve(b.cast<Complex>().eval()) +
                                      d;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const Complex x = i == j ? 1. / characteristic(s, i) : 0.;
        EXPECT_LT(std::abs(response(i, j) - x), 1e-9) << w << ' ' << i << ' ' << j;
        EXPECT_LT(std::abs(response(3 + i, j) - s * x), 1e-9 * (1 + w))
            << w << ' ' << i << ' ' << j;
      }
  }
}

TEST_F(Analysed, DescriptorFormIsSingularAtTheEigenvalues) {
  linearize_.set_descriptor_form(true);
  const v1::LinearizeReply reply = answer(linearize_);
  EXPECT_TRUE(reply.a().sparse());
  const MatX a = matrix(reply.a()), e = matrix(reply.e()), b = matrix(reply.b()),
             c = matrix(reply.c());
  ASSERT_EQ(a.rows(), simulation_->model().unknowns);
  ASSERT_EQ(e.rows(), a.rows());
  ASSERT_EQ(reply.state_names_size(), a.rows());
  const auto smallest = [&](Complex s) {
    const Eigen::MatrixXcd pencil = s * e.cast<Complex>() - a.cast<Complex>();
    return Eigen::JacobiSVD<Eigen::MatrixXcd>(pencil).singularValues().minCoeff();
  };
  for (const Complex s : {Complex(-2, std::sqrt(396.)), Complex(0, 30), Complex(0, -40)}) {
    EXPECT_LT(smallest(s), 1e-6) << s;
    EXPECT_GT(smallest(s + Complex(0, 1)), 1e-3) << s;
  }
  const Complex s(0, 7);
  const Eigen::MatrixXcd response =
      c *
      (s * e.cast<Complex>() - a.cast<Complex>()).partialPivLu().solve(b.cast<Complex>().eval());
  for (int i = 0; i < 3; ++i)
    EXPECT_LT(std::abs(response(i, i) - 1. / characteristic(s, i)), 1e-9) << i;
}

TEST_F(Analysed, DescriptorFormRefusesOutputsOfRates) {
  linearize_.set_descriptor_form(true);
  linearize_.add_outputs(handle("node.structural.1.XP"));
  EXPECT_EQ(refusal(linearize_), v1::REASON_BAD_ARGUMENT);
}

TEST_F(Analysed, EigenvaluesAreThoseOfTheSprings) {
  eigenvalues_.set_eigenvectors(true);
  const v1::ComputeEigenvaluesReply reply = answer(eigenvalues_);
  ASSERT_EQ(reply.real_size(), 6);
  ASSERT_EQ(reply.imaginary_size(), 6);
  for (const Complex& expected :
       {Complex(-2, std::sqrt(396.)), Complex(0, std::sqrt(1800. / kMass)), Complex(0, 40)})
    for (const Complex& s : {expected, std::conj(expected)}) {
      double nearest = 1e9;
      for (int k = 0; k < 6; ++k)
        nearest = std::min(nearest, std::abs(Complex(reply.real(k), reply.imaginary(k)) - s));
      EXPECT_LT(nearest, 1e-6) << s;
    }
  linearize_.set_descriptor_form(true);
  const v1::LinearizeReply system = answer(linearize_);
  const MatX a = matrix(system.a()), e = matrix(system.e());
  const Eigen::MatrixXcd vectors =
      matrix(reply.vectors_real()).cast<Complex>() +
      Complex(0, 1) * matrix(reply.vectors_imaginary()).cast<Complex>();
  ASSERT_EQ(vectors.cols(), 6);
  for (int k = 0; k < 6; ++k) {
    const Complex s(reply.real(k), reply.imaginary(k));
    EXPECT_NEAR(vectors.col(k).norm(), 1, 1e-9);
    const Eigen::VectorXcd left = a * vectors.col(k), right = e * vectors.col(k);
    EXPECT_LT((left - s * right).norm(), 1e-6 * std::abs(s)) << s;
  }
}

TEST_F(Analysed, OneEigenvalueIsTheNearestToTheShift) {
  eigenvalues_.set_count(1);
  eigenvalues_.set_shift(31 / (2 * M_PI));
  const v1::ComputeEigenvaluesReply reply = answer(eigenvalues_);
  ASSERT_EQ(reply.real_size(), 1);
  EXPECT_NEAR(reply.real(0), 0, 1e-6);
  EXPECT_NEAR(reply.imaginary(0), 30, 1e-6);
}

TEST_F(Analysed, PagesHaveTheSameNumbersOfOneState) {
  simulation_->step();
  linearize_.set_descriptor_form(true);
  const v1::LinearizeReply system = answer(linearize_);
  eigenvalues_.set_eigenvectors(true);
  const v1::ComputeEigenvaluesReply spectrum = answer(eigenvalues_);
  EXPECT_EQ(system.step(), 1);
  linearize_.set_page_size(7);
  eigenvalues_.set_page_size(7);
  states_taken_ = 0;
  int pages = 0;
  EXPECT_TRUE(MessageDifferencer::Equals(joined(linearize_, &pages), system));
  EXPECT_GT(pages, 5);
  EXPECT_TRUE(MessageDifferencer::Equals(joined(eigenvalues_, &pages), spectrum));
  EXPECT_GT(pages, 5);
  EXPECT_EQ(states_taken_, 2) << "all pages are of one state";
}

TEST_F(Analysed, RefusesTokensOfAnotherRequest) {
  linearize_.set_page_size(7);
  const std::string token = answer(linearize_).next_page_token();
  ASSERT_NE(token, "");
  for (const std::string& wrong : {std::string("x"), token + "x", "9" + token}) {
    linearize_.set_page_token(wrong);
    EXPECT_EQ(refusal(linearize_), v1::REASON_BAD_ARGUMENT) << wrong;
  }
  linearize_.set_page_token(token);
  linearize_.set_descriptor_form(true);
  EXPECT_EQ(refusal(linearize_), v1::REASON_BAD_ARGUMENT) << "of another question";
  linearize_.set_descriptor_form(false);
  EXPECT_EQ(refusal(linearize_), v1::REASON_UNSPECIFIED);
}

TEST_F(Analysed, OfACancelledCallIsCancelledAndLeavesNothingTaken) {
  call_.cancel();
  EXPECT_EQ(refusal(linearize_), v1::REASON_CANCELLED);
  EXPECT_EQ(refusal(eigenvalues_), v1::REASON_CANCELLED);
  EXPECT_EQ(memory_.used(), 0);
}

TEST_F(Analysed, RefusesWhatMakesNoSense) {
  v1::LinearizeRequest beyond = linearize_, negative = linearize_, no_input = linearize_,
                       no_page = linearize_;
  beyond.add_outputs(static_cast<int>(simulation_->variables().size()));
  EXPECT_EQ(refusal(beyond), v1::REASON_NO_SUCH_VARIABLE);
  negative.add_inputs(-1);
  EXPECT_EQ(refusal(negative), v1::REASON_NO_SUCH_VARIABLE);
  no_input.add_inputs(handle("time"));
  EXPECT_EQ(refusal(no_input), v1::REASON_BAD_ARGUMENT);
  no_page.set_page_size(0);
  EXPECT_EQ(refusal(no_page), v1::REASON_BAD_ARGUMENT);
  for (const int count : {0, -1}) {
    eigenvalues_.set_count(count);
    EXPECT_EQ(refusal(eigenvalues_), v1::REASON_BAD_ARGUMENT) << count;
  }
  eigenvalues_.clear_count();
  for (const double shift : {std::nan(""), HUGE_VAL}) {
    eigenvalues_.set_shift(shift);
    EXPECT_EQ(refusal(eigenvalues_), v1::REASON_BAD_ARGUMENT) << shift;
  }
}

}  // namespace
}  // namespace mbcosim::server::analysis_test
