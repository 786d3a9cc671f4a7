#include "solver/divergence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "elements/bodies/body.h"
#include "elements/element_set_of.h"
#include "solver/system.h"

namespace mbcosim {

namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Diagonal of the box around all structural nodes, at the start or now, whichever is larger [m].
double size_of(const Model& model, const State& state) {
  Eigen::AlignedBox3d start, now;
  for (const StructuralNode& node : model.structural) {
    if (node.is_dummy()) continue;
    start.extend(node.x);
    now.extend(Vec3(&state.y[node.first]));
  }
  return start.isEmpty() ? 0 : std::max(start.diagonal().norm(), now.diagonal().norm());
}

VecX residual_at(const Model& model, State state, double time) {
  state.time = time;
  std::vector<double> r(static_cast<std::size_t>(model.unknowns));
  Scratch scratch(model.scratch);
  compute_residual(model.context(state, Phase::step), scratch, r);
  return Eigen::Map<const VecX>(r.data(), static_cast<Eigen::Index>(r.size()));
}

/// The residual's change by time alone, against that in the step before.
std::string jump_of_loads(const Model& model, const State& before, double h) try {
  constexpr double kJump = 100;
  const VecX now = residual_at(model, before, before.time);
  const VecX jump = (residual_at(model, before, before.time + h) - now).cwiseAbs();
  const VecX earlier = (now - residual_at(model, before, before.time - h)).cwiseAbs();
  Eigen::Index row = 0;
  const double largest = jump.size() > 0 ? jump.maxCoeff(&row) : 0;
  if (!(largest > kJump * earlier.maxCoeff()) || !(largest > 1e-3 * now.cwiseAbs().maxCoeff()) ||
      !(largest > 0))
    return {};
  const auto [owner, equation] = model.row_text(static_cast<int>(row));
  return "a load or drive jumps within this step, by " + number(largest) + " in " + owner + ", " +
         equation +
         ": let it grow over several steps (a `ramp` or `cosine` drive), or shorten the "
         "time step there (`strategy: factor` does it when needed)";
} catch (const EvaluationError&) {
  return {};
}

/// A rotation of a radian in one step is beyond what the parameters of the increment carry well.
std::string far_turn(const Model& model, const State& before, double h) {
  constexpr double kFar = 0.7, kGood = 0.1;  // [rad]
  double largest = 0;
  int label = 0;
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    if (!model.structural[k].has_rotation()) continue;
    const double angle = before.rotation[k].w.norm() * h;
    if (!(angle > largest)) continue;
    largest = angle;
    label = model.structural[k].label;
  }
  if (largest < kFar) return {};
  return "the time step is too long: structural node " + std::to_string(label) + " turns by " +
         number(largest) + " rad within it; shorten it to about " + number(h * kGood / largest) +
         " s";
}

}  // namespace

std::string remedy_by_units(const Model& model, const State& state) {
  // kg mm² for kg m², or the reverse, changes the radius a thousandfold; small bodies are common.
  constexpr double kLarge = 30, kSmall = 1.0 / 3000;
  const double size = size_of(model, state);
  if (!(size > 0)) return {};
  for (const auto& set : model.sets) {
    const auto* bodies = dynamic_cast<const ElementSetOf<Body>*>(set.get());
    for (int i = 0; bodies && i < bodies->size(); ++i) {
      const Body& body = bodies->element(i);
      if (!(body.m > 0) || !(body.J0.trace() > 0)) continue;
      const double radius = std::sqrt(body.J0.trace() / (2 * body.m));
      if (radius < kLarge * size && radius > kSmall * size) continue;
      return "body " + std::to_string(bodies->info(i).label) + " has a radius of gyration of " +
             number(radius) + ", in a model that measures " + number(size) +
             ": check the units of its mass and inertia, and those of positions and loads";
    }
  }
  return {};
}

std::string remedy_by_cause(const Model& model, const State& before, double h) {
  const std::string text = jump_of_loads(model, before, h);
  return text.empty() ? far_turn(model, before, h) : text;
}

bool goes_to_and_fro(const std::vector<double>& history) {
  constexpr double kNear = 0.1, kBounded = 10;
  const auto near = [&](double a, double b) { return std::abs(a - b) <= kNear * b; };
  int returns = 0;
  for (std::size_t k = 1; k < history.size(); ++k) {
    if (!(history[k] <= kBounded * history[0])) return false;
    const bool back =
        near(history[k], history[k - 1]) || (k > 1 && near(history[k], history[k - 2]));
    returns += back ? 1 : 0;
  }
  return returns >= 4;
}

std::string remedy_by_course(const std::vector<double>& history,
                             const std::vector<WorstEquation>& worst, bool in_step) {
  int rises = 0, falls = 0, stays = 0, last_falls = 0;
  for (std::size_t k = 1; k < history.size(); ++k) {
    const double ratio = history[k] / history[k - 1];
    rises += ratio > 1.2 ? 1 : 0;
    falls += ratio < 0.8 ? 1 : 0;
    stays += ratio >= 0.9 && ratio <= 1.1 ? 1 : 0;
    last_falls = ratio < 0.9 ? last_falls + 1 : 0;
  }
  constexpr double kRounding = 1e-14;  // of the largest residual
  const auto [least, most] = std::minmax_element(history.begin(), history.end());
  const std::string phase = in_step ? "`" : "`derivatives ";
  if (!history.empty() && *least < kRounding * *most && last_falls < 2)
    return "the residual has reached what rounding leaves of it: the tolerance is too small for "
           "loads of this size; write a larger " +
           phase + "tolerance`";
  if (in_step && ((rises >= 2 && falls >= 2) || stays >= 4))
    return "the iteration goes to and fro" + (worst.empty() ? "" : " at " + worst[0].owner) +
           ": a contact, a stop, friction or the corner of a law or drive opens and closes; "
           "shorten "
           "the time step there (`strategy: factor`), smooth the law, or search along lines "
           "(`nonlinear solver: line search`)";
  if (last_falls >= 2)
    return "the residual was still falling: allow more " + phase + "max iterations`" +
           (in_step ? ", or shorten the time step" : "");
  return {};
}

}  // namespace mbcosim
