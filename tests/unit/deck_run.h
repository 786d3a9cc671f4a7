/// Runs decks that stand as text in a test.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "simulation/simulation.h"

namespace mbcosim {

/// A deck with its simulation, stepped by hand. Failures are test failures with the diagnostics'
/// text.
class DeckRun {
 public:
  explicit DeckRun(std::map<std::string, std::string> files, const std::string& main = "deck.mbd") {
    const LoadReport report = load_deck(BundleSource(std::move(files)), main);
    std::string text;
    for (const Diagnostic& d : report.diagnostics)
      if (d.severity == Severity::error) text += d.text() + "\n";
    EXPECT_TRUE(report.ok()) << text;
    if (!report.ok()) return;
    auto created = Simulation::create(report.model);
    EXPECT_TRUE(created) << created.error().message;
    if (created) simulation_ = std::move(*created);
  }
  explicit DeckRun(const std::string& deck)
      : DeckRun(std::map<std::string, std::string>{{"deck.mbd", deck}}) {}

  /// Did the deck load and start?
  bool ready() const { return simulation_ != nullptr; }
  Simulation& simulation() { return *simulation_; }
  const Model& model() const { return simulation_->model(); }

  void step(int count = 1) {
    const StepReport report = simulation_->step_many(count);
    ASSERT_FALSE(report.error) << report.error->message;
  }
  NodeState node(int label) const {
    return model().node_state(context(), model().find_structural(label));
  }
  NodeAcceleration acceleration(int label) const {
    return model().node_acceleration(context(), model().find_structural(label));
  }
  Vec3 rotation_vector(int label) const { return vector_of_rotation(node(label).R); }
  double scalar_node(ScalarKind kind, int label) const {
    return simulation_->state().y[model().scalars[model().find_scalar(kind, label)].unknown];
  }
  /// Private datum of an element.
  double datum(Family family, int label, const std::string& name) const {
    const ElementRef e = model().find_element(family, label);
    EXPECT_NE(e.set, nullptr) << family_name(family) << " " << label;
    const int index = e.set->private_datum(e.index, name);
    EXPECT_GE(index, 0) << name;
    return e.set->private_value(context(), e.index, index);
  }
  /// Own unknown k of an element.
  double own(Family family, int label, int k = 0) const {
    const ElementRef e = model().find_element(family, label);
    return simulation_->state().y[e.set->first_own(e.index) + k];
  }
  EvalContext context() const { return model().context(simulation_->state(), Phase::step); }

 private:
  std::unique_ptr<Simulation> simulation_;
};

/// The control block of a plain initial value problem with a fixed step.
inline std::string initial_value_block(double h, double final_time, const std::string& more = "") {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: " +
         std::to_string(final_time) + "; time step: " + std::to_string(h) + "; " + more +
         " end: initial value;\n";
}

}  // namespace mbcosim
