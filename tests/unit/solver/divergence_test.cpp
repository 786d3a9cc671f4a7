/// Remedies for steps that did not converge.
#include "solver/divergence.h"

#include <gmock/gmock.h>

#include "deck_run.h"

namespace mbcosim::divergence_test {
namespace {

using testing::HasSubstr;

TEST(GoesToAndFro, IsBoundedAndComesBack) {
  EXPECT_TRUE(goes_to_and_fro({2.8, 2.8, 2.8, 2.8, 2.8, 1.4}));
  EXPECT_TRUE(goes_to_and_fro({3, 7, 3.1, 7.1, 3.0, 7}));
  EXPECT_FALSE(goes_to_and_fro({103, 105, 103, 103, 102, 3e4})) << "diverges";
  EXPECT_FALSE(goes_to_and_fro({2.8, 2.8, 2.8, 2.8, 2.8, NAN}));
  EXPECT_FALSE(goes_to_and_fro({1e3, 1e2, 1e1, 1, .1, .01, 1e-3}));
  EXPECT_FALSE(goes_to_and_fro({}));
}

TEST(RemedyByCourse, NamesTheCardsOfThePhase) {
  const std::vector<double> falling{8, 4, 2, 1};
  EXPECT_THAT(remedy_by_course(falling, {}, true), HasSubstr("more `max iterations`"));
  EXPECT_THAT(remedy_by_course(falling, {}, false), HasSubstr("more `derivatives max iterations`"));
  const std::vector<double> turning{8, 4, 8, 4, 8, 8, 8, 8};
  EXPECT_THAT(remedy_by_course(turning, {}, true), HasSubstr("to and fro"));
  EXPECT_EQ(remedy_by_course(turning, {}, false), "") << "no step to shorten";
}

/// Two bodies 1 m apart, the second with this moment of inertia [kg·m²].
ModelPtr two_bodies(const std::string& inertia) {
  const LoadReport report =
      load_deck(BundleSource({{"deck.mbd", R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; max iterations: 20; tolerance: 1e-6; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic, 1.,0.,0., eye, null, null; end: nodes;
begin: elements; body: 1, 1, 1., null, diag, .1,.1,.1; body: 2, 2, 1., null, diag, )" +
                                               inertia + "," + inertia + "," + inertia +
                                               "; end: elements;"}}),
                "deck.mbd");
  return report.model;
}

TEST(RemedyByUnits, NamesTheBodyWhoseInertiaIsStrange) {
  const ModelPtr model = two_bodies("1.e-8");
  ASSERT_TRUE(model);
  EXPECT_THAT(remedy_by_units(*model, make_initial_state(*model)),
              HasSubstr("body 2 has a radius of gyration of 0.000122, in a model that measures 1"));
}

TEST(RemedyByUnits, IsSilentWhenNodesMeet) {
  const ModelPtr model = two_bodies(".1");
  ASSERT_TRUE(model);
  State state = make_initial_state(*model);
  EXPECT_EQ(remedy_by_units(*model, state), "");
  state.y[model->structural[1].first] = 1e-3;  // the bodies have come together
  EXPECT_EQ(remedy_by_units(*model, state), "");
}

}  // namespace
}  // namespace mbcosim::divergence_test
