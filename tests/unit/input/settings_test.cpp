#include <gtest/gtest.h>

#include <cmath>

#include "deck_fixture.h"

namespace mbcosim::decks::settings_test {
namespace {

InitialValueSettings initial_value(const std::string& cards) {
  DeckText d;
  d.initial_value = cards;
  const ModelPtr model = model_of(d);
  return model ? model->initial_value : InitialValueSettings{};
}
ModelPtr control(const std::string& cards) {
  DeckText d;
  d.control = cards;
  return model_of(d);
}

TEST(InitialValue, HasTheDocumentedDefaults) {
  const InitialValueSettings s = initial_value("");
  EXPECT_EQ(s.time_step, 1);
  EXPECT_EQ(s.final_time, 0);
  EXPECT_EQ(s.max_iterations, 1);
  EXPECT_EQ(s.tolerance, 1e-6);
  EXPECT_EQ(s.residual_test, ResidualTest::norm);
  EXPECT_EQ(s.solution_test, ResidualTest::none);
  EXPECT_EQ(s.derivatives_max_iterations, 1);
  EXPECT_EQ(s.derivatives_coefficient, 1e-6);
  EXPECT_EQ(s.method.method, Method::multistep);
  EXPECT_FALSE(s.method.rho);
  EXPECT_FALSE(s.modified_newton);
}

TEST(InitialValue, ReadsTimes) {
  const InitialValueSettings s = initial_value(
      "initial time: 1.; final time: forever; time step: 2e-3; min time step: 1e-6; max time step: "
      "1e-2, hard limit, no;"
      "strategy: factor, .5, 2, 1.2, 3, 4, 9;");
  EXPECT_EQ(s.initial_time, 1);
  EXPECT_TRUE(std::isinf(s.final_time));
  EXPECT_EQ(s.time_step, 2e-3);
  EXPECT_EQ(s.min_time_step, 1e-6);
  ASSERT_TRUE(s.max_time_step);
  EXPECT_EQ(s.max_time_step->value(EvalContext{}), 1e-2);
  EXPECT_EQ(s.strategy, StepStrategy::factor);
  EXPECT_EQ(s.reduction, .5);
  EXPECT_EQ(s.steps_before_reduction, 2);
  EXPECT_EQ(s.raise, 1.2);
  EXPECT_EQ(s.steps_before_raise, 3);
  EXPECT_EQ(s.min_iterations, 4);
  EXPECT_EQ(s.max_iterations_factor, 9);
}

TEST(InitialValue, ReadsTolerances) {
  InitialValueSettings s = initial_value(
      "tolerance: 1e-4, test, minmax, scale, 1e-3, test, norm; max iterations: 7, at most;");
  EXPECT_EQ(s.tolerance, 1e-4);
  EXPECT_EQ(s.residual_test, ResidualTest::minmax);
  EXPECT_TRUE(s.scale_residual);
  EXPECT_EQ(s.solution_tolerance, 1e-3);
  EXPECT_EQ(s.solution_test, ResidualTest::norm);
  EXPECT_EQ(s.max_iterations, 7);
  EXPECT_TRUE(s.at_most);
  s = initial_value("tolerance: null, 1e-5;");
  EXPECT_EQ(s.residual_test, ResidualTest::none);
  EXPECT_EQ(s.solution_test, ResidualTest::norm);
  s = initial_value(
      "max residual: differential equations, 1e3, all equations, 1e4;"
      "enforce constraint equations: constraint violations, scale factor, 2.;");
  EXPECT_EQ(s.max_residual_differential, 1e3);
  EXPECT_EQ(s.max_residual, 1e4);
  EXPECT_TRUE(s.constraint_violations);
  EXPECT_EQ(s.constraint_scale, 2);
}

TEST(InitialValue, ReadsDerivativesAndDummySteps) {
  const InitialValueSettings s = initial_value(
      "derivatives tolerance: 1e-3; derivatives max iterations: 8; derivatives coefficient: 1e-2, "
      "auto, max iterations, 4, factor, 5.;"
      "dummy steps number: 3; fictitious steps ratio: 1e-2; dummy steps tolerance: 1e-4; dummy "
      "steps max iterations: 5;"
      "dummy steps method: crank nicolson;");
  EXPECT_EQ(s.derivatives_tolerance, 1e-3);
  EXPECT_EQ(s.derivatives_max_iterations, 8);
  EXPECT_EQ(s.derivatives_coefficient, 1e-2);
  EXPECT_TRUE(s.derivatives_auto);
  EXPECT_EQ(s.derivatives_auto_iterations, 4);
  EXPECT_EQ(s.derivatives_auto_factor, 5);
  EXPECT_EQ(s.dummy_steps, 3);
  EXPECT_EQ(s.dummy_ratio, 1e-2);
  EXPECT_EQ(s.dummy_tolerance, 1e-4);
  EXPECT_EQ(s.dummy_max_iterations, 5);
  ASSERT_TRUE(s.dummy_method);
  EXPECT_EQ(s.dummy_method->method, Method::crank_nicolson);
}

TEST(InitialValue, ReadsMethods) {
  const auto method = [](const std::string& text) {
    return initial_value("method: " + text + ";").method;
  };
  EXPECT_EQ(method("crank nicolson").method, Method::crank_nicolson);
  EXPECT_EQ(method("Crank Nicholson").method, Method::crank_nicolson);
  const MethodSettings ms = method("ms, .6");
  EXPECT_EQ(ms.method, Method::multistep);
  EXPECT_EQ(ms.rho->value(EvalContext{}), .6);
  EXPECT_EQ(ms.rho_algebraic->value(EvalContext{}), .6);
  const MethodSettings hope = method("hope, .6, .1");
  EXPECT_EQ(hope.method, Method::hope);
  EXPECT_EQ(hope.rho_algebraic->value(EvalContext{}), .1);
  EXPECT_EQ(method("nostro, 0.").method, Method::multistep);
  EXPECT_EQ(method("third order, ad hoc").method, Method::third_order_ad_hoc);
  EXPECT_EQ(method("third order, .8").method, Method::third_order);
  EXPECT_EQ(method("bdf").method, Method::multistep);
  EXPECT_EQ(method("bdf, order, 1").method, Method::bdf1);
  EXPECT_EQ(method("implicit euler").method, Method::bdf1);
}

TEST(InitialValue, ReadsSolvers) {
  InitialValueSettings s = initial_value(
      "nonlinear solver: newton raphson, modified, 5, keep jacobian matrix, honor element requests;"
      "linear solver: naive, colamd, mt, 2, pivot factor, 1e-5; threads: assembly, 2;");
  EXPECT_TRUE(s.modified_newton);
  EXPECT_EQ(s.jacobian_every, 5);
  EXPECT_TRUE(s.keep_jacobian);
  s = initial_value("newton raphson: modified;");
  EXPECT_EQ(s.jacobian_every, 2);
  s = initial_value("newton raphson: true;");
  EXPECT_FALSE(s.modified_newton);
  s = initial_value(
      "nonlinear solver: line search, modified, 3, tolerance x, 1e-5, lambda min, 1e-3, relative, "
      "no, algorithm, factor,"
      " divergence check, yes, factor, 2., zero gradient, continue, yes, scale newton step, yes, "
      "min scale, 1e-2;");
  ASSERT_TRUE(s.line_search);
  EXPECT_EQ(s.jacobian_every, 3);
  EXPECT_EQ(s.line_search->tolerance_x, 1e-5);
  EXPECT_FALSE(s.line_search->lambda_min_relative);
  EXPECT_FALSE(s.line_search->cubic);
  EXPECT_EQ(s.line_search->divergence_factor, 2);
  EXPECT_TRUE(s.line_search->zero_gradient_continue);
  EXPECT_EQ(s.line_search->min_scale, 1e-2);
  s = initial_value(
      "nonlinear solver: matrix free, gmres, tolerance, 1e-3, preconditioner, full jacobian, "
      "steps, 3;");
  EXPECT_FALSE(s.line_search);
}

TEST(InitialValue, ReadsOutputAndEigenanalysis) {
  const InitialValueSettings s = initial_value(
      "output: iterations, residual, jacobian matrix, matrix condition number, norm, inf; abort "
      "after: derivatives;"
      "eigenanalysis: list, 2, 0., 1., parameter, 1e-2, output full matrices, output eigenvectors, "
      "output geometry,"
      " upper frequency limit, 50., suffix width, 3, suffix format, \"%03d\", use lapack, balance, "
      "permute;");
  EXPECT_EQ(s.abort_after, InitialValueSettings::AbortAfter::derivatives);
  ASSERT_TRUE(s.eigenanalysis);
  const EigenSettings& e = *s.eigenanalysis;
  EXPECT_EQ(e.times, (std::vector<double>{0, 1}));
  EXPECT_EQ(e.parameter, 1e-2);
  EXPECT_TRUE(e.matrices_full && e.eigenvectors && e.geometry);
  EXPECT_EQ(e.upper_frequency, 50);
  EXPECT_EQ(e.suffix_width, 3);
}

TEST(InitialValue, TakesTheLastEigenanalysisOnly) {
  DeckText d;
  d.initial_value = "eigenanalysis: 0.; eigenanalysis: 2., use arpack, 10, 20, 1e-3;";
  const LoadReport report = load(d);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(findings(report.diagnostics),
            "warning: the eigenanalysis card before this one has no effect");
  const EigenSettings& e = *report.model->initial_value.eigenanalysis;
  EXPECT_EQ(e.times, std::vector<double>{2});
  EXPECT_EQ(e.solver, EigenSettings::Solver::arpack);
  EXPECT_EQ(e.ncv, 20);
}

TEST(ControlData, ReadsAssemblyAndOutput) {
  const ModelPtr model = control(
      "skip initial joint assembly; use: beams, forces, in assembly; initial tolerance: "
      "1e-3; max initial iterations: 9;"
      "initial stiffness: 2., 3.; omega rotates: yes; epsilon: .5; output frequency: 4; output "
      "precision: 12;"
      "default orientation: orientation vector; output results: netcdf, no text; title: \"a "
      "\\\"b\\\"\"; print: dof stats, to file;"
      "default output: reference frames, drive callers; select timeout: forever; default beam "
      "output: position;");
  ASSERT_TRUE(model);
  const ControlSettings& c = model->control;
  EXPECT_TRUE(c.skip_assembly && c.assemble_forces);
  EXPECT_EQ(c.assembly_tolerance, 1e-3);
  EXPECT_EQ(c.assembly_max_iterations, 9);
  EXPECT_EQ(c.position_stiffness, 2);
  EXPECT_EQ(c.velocity_stiffness, 3);
  EXPECT_TRUE(c.omega_rotates);
  EXPECT_EQ(c.assembly_epsilon, .5);
  EXPECT_EQ(c.output_frequency, 4);
  EXPECT_EQ(c.output_precision, 12);
  EXPECT_EQ(c.orientation, OrientationDescription::vector);
  EXPECT_TRUE(c.netcdf);
  EXPECT_TRUE(c.output_reference_frames && c.output_drives);
  EXPECT_EQ(model->title, "a \"b\"");
}

/// Of decks for later versions of the reference solver; they change no results.
TEST(NewerWords, AreReadWithANote) {
  const LoadReport report = load(
      "begin: data; problem: initial value; end: data;"
      "begin: initial value; time step: 1e-2; derivatives tolerance: 1e-3, 1e-6; linear solver: "
      "pastix, grad, scale, iterative, always, max iterations, 10; end: initial value;"
      "begin: control data; use automatic differentiation; output units: MKS; output results: "
      "netcdf, netcdf4, no sync, text; end: control data;"
      "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;"
      "begin: elements; body: 1, 1, 1., null, diag, 1.,2.,2.5, orientation, euler, 0.,0.,pi/2.; "
      "end: elements;");
  EXPECT_TRUE(report.ok()) << findings(report.diagnostics);
  int notes = 0;
  for (const Diagnostic& d : report.diagnostics) {
    EXPECT_EQ(d.severity, Severity::note) << d.text();
    notes += d.severity == Severity::note;
  }
  EXPECT_EQ(notes, 3);
}

TEST(WordsWithoutEffect, AreNamed) {
  const auto finding = [](const std::string& initial_value, const std::string& control) {
    DeckText d;
    d.initial_value = initial_value;
    d.control = control;
    std::string found;
    for (const Diagnostic& x : load(d.text()).diagnostics)
      found += std::string(severity_name(x.severity)) + ": " + x.message;
    return found;
  };
  const std::string printed =
      "note: output: nothing is printed during the iterations; `.out` has their number and the "
      "residual of each step";
  EXPECT_EQ(finding("output: iterations, matrix condition number, norm, inf;", ""), printed);
  EXPECT_EQ(finding("output: cpu time;", ""), printed);
  EXPECT_EQ(finding("output: residual, none;", ""), "");
  EXPECT_EQ(finding("output: none, messages;", ""), "");
  EXPECT_EQ(finding("output: none, iterations;", ""),
            "note: output: nothing is printed during the iterations; `.out` has no line of a step "
            "without `messages`");
  EXPECT_EQ(finding("max time step: 1e-2, hard limit, no;", ""),
            "note: max time step: `hard limit` has no effect: the strategy treats the limit in one "
            "way");
  EXPECT_EQ(finding("nonlinear solver: line search, non negative slope continue, yes;", ""),
            "note: nonlinear solver: `non negative slope continue` has no effect: along a "
            "correction the slope of the squared residual is taken as negative");
  EXPECT_EQ(finding("", "use: beams, forces, loadable elements, in assembly;"), "");
  for (const char* word : {"rigid bodies", "gravity", "plates", "aerodynamic elements"})
    EXPECT_EQ(finding("", std::string("use: ") + word + ", in assembly;"),
              "warning: without effect: these elements take no part in the initial assembly");
}

TEST(ControlData, ReadsTheMotionOfTheFrame) {
  const ModelPtr model =
      control("rigid body kinematics: const, velocity, 1.,2.,3., angular velocity, 0.,0.,4.;");
  ASSERT_TRUE(model && model->frame_motion);
  EXPECT_FALSE(model->frame_motion->position);
  EXPECT_EQ(model->frame_motion->velocity->value(EvalContext{}), Vec3(1, 2, 3));
  EXPECT_EQ(model->frame_motion->angular_velocity->value(EvalContext{}), Vec3(0, 0, 4));
}

TEST(Digest, ChangesWithAnyFile) {
  const std::string text = "include: \"a.inc\";";
  const auto digest = [&](const std::string& deck, const std::string& included) {
    const LoadReport r = load(deck, {{"a.inc", included}});
    EXPECT_TRUE(r.ok()) << findings(r.diagnostics);
    return r.model ? r.model->digest : 0;
  };
  const std::uint64_t base = digest(text, "set: integer a = 1;");
  EXPECT_EQ(base, digest(text, "set: integer a = 1;"));
  EXPECT_NE(base, digest(text, "set: integer a = 2;"));
  EXPECT_NE(base, digest(text + " ", "set: integer a = 1;"));
}

}  // namespace
}  // namespace mbcosim::decks::settings_test
