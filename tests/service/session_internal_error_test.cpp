/// A mistake of ours in an element fails the session that has the element, and no other.
#include <gtest/gtest.h>

#include "cli/deck_report.h"
#include "elements/general_element.h"
#include "model/check.h"
#include "service/session.h"
#include "shared_parts.h"
#include "wire/refusal.h"

namespace mbcosim::server::session_internal_error_test {
namespace {

/// Row −λ; from `until` on a check of the element fails.
class Mistaken final : public GeneralElement {
 public:
  explicit Mistaken(double until) : until_(until) {}
  void connect(GeneralConnection& c) override { own_ = c.algebraic(1); }
  void residual(const GeneralView& u, GeneralResidual& r) const override {
    MBCOSIM_CHECK(u.time() < until_, "this test's mistake");
    r.add(own_, -u.value(own_));
  }
  void jacobian(const GeneralView&, GeneralJacobian& j) const override { j.value(own_, own_, -1.); }

 private:
  double until_;
  int own_ = 0;
};

std::unique_ptr<Simulation> simulation_that_fails_at(double time) {
  ModelBuilder builder;
  InitialValueSettings& settings = builder.model().initial_value;
  settings.time_step = .1;
  settings.final_time = 10;
  settings.max_iterations = 5;
  ElementInfo info;
  info.label = 1;
  add_general_element(builder, info, std::make_unique<Mistaken>(time));
  auto model = builder.finish();
  EXPECT_TRUE(model);
  auto created = Simulation::create(*model);
  EXPECT_TRUE(created);
  return std::move(*created);
}

class TwoSessions : public testing::Test {
 protected:
  static Session::Identity named(const char* id) {
    Session::Identity identity;
    identity.id = id;
    return identity;
  }
  static v1::StepReply step(Session& session, int steps) {
    v1::StepRequest request;
    request.set_steps(steps);
    v1::StepReply reply;
    Call call;
    session.step(request, {"local", Role::control}, call, &reply);
    return reply;
  }
  static v1::Reason refusal_of_step(Session& session) {
    try {
      step(session, 1);
    } catch (const Refusal& refusal) {
      return refusal.reason();
    }
    return v1::REASON_UNSPECIFIED;
  }

  SharedParts daemon_{2};
  Session mistaken_{named("simulations/a"), {}, simulation_that_fails_at(.25), daemon_.shared};
  Session other_{named("simulations/b"), {}, simulation_that_fails_at(1e9), daemon_.shared};
};

TEST_F(TwoSessions, AnInternalErrorFailsOneSessionAndNoOther) {
  EXPECT_EQ(step(mistaken_, 2).steps_done(), 2);
  EXPECT_EQ(refusal_of_step(mistaken_), v1::REASON_INTERNAL);
  EXPECT_NE(refusal_of_step(mistaken_), v1::REASON_UNSPECIFIED) << "it stays failed";
  v1::SimulationInfo info;
  mistaken_.fill(&info);
  EXPECT_EQ(info.step(), 2) << "the state is that of the last accepted step";
  EXPECT_EQ(step(other_, 5).steps_done(), 5);
  EXPECT_TRUE(mistaken_.capture().failed) << "its state is not to be stored";
  EXPECT_FALSE(other_.capture().failed);
}

TEST(ExitCode, OfAnInternalErrorIsItsOwn) {
  LoadReport report;
  Diagnostic d;
  d.code = "internal";
  report.diagnostics.push_back(d);
  EXPECT_EQ(cli::exit_code_of(report), cli::kInternalError);
  Error error;
  error.kind = ErrorKind::internal;
  EXPECT_EQ(cli::exit_code_of(error), cli::kInternalError);
}

}  // namespace
}  // namespace mbcosim::server::session_internal_error_test
