/// `mbcosim eig`: eigenvalues of a deck about its initial or a later state.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "cli/commands.h"
#include "cli/deck_report.h"
#include "model/model_part.h"
#include "model/unit_system.h"
#include "solver/eigen_spectrum.h"
#include "threads/interrupt.h"

namespace mbcosim::cli {
namespace {

/// Oscillations by frequency with the sign of the imaginary part left out, then real eigenvalues.
std::vector<Eigen::Index> order(const Eigen::VectorXcd& values) {
  const double noise = 1e-9 * (values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0);
  std::vector<Eigen::Index> indices(static_cast<std::size_t>(values.size()));
  std::iota(indices.begin(), indices.end(), 0);
  std::erase_if(indices, [&](Eigen::Index k) { return values(k).imag() < -noise; });
  std::sort(indices.begin(), indices.end(), [&](Eigen::Index a, Eigen::Index b) {
    const bool real_a = values(a).imag() <= noise, real_b = values(b).imag() <= noise;
    if (real_a != real_b) return real_b;
    return real_a ? values(a).real() > values(b).real() : values(a).imag() < values(b).imag();
  });
  return indices;
}

double seconds_in_unit_of_time(const UnitSystem* units) {
  constexpr Dimension kTime{0, 0, 1};
  return units ? units->si(kTime) : 1;
}

/// `units`: declared by the deck; null: SI units.
void print(const Eigen::VectorXcd& values, double time, const UnitSystem* units) {
  constexpr double kNoise = 1e-6;  // of an undamped mode [%]
  const auto unit = [&](const char* si) { return units ? units->name(si) : std::string(si); };
  const double second = seconds_in_unit_of_time(units);
  const auto heading = [&](const char* what, const char* si) {
    return what + std::string(" [") + unit(si) + "]";
  };
  std::printf("eigenvalues at t = %.9g %s\n  %16s %16s %14s %12s\n", time, unit("s").c_str(),
              heading("real", "1/s").c_str(), heading("imaginary", "rad/s").c_str(),
              "frequency [Hz]", "damping [%]");
  for (const Eigen::Index k : order(values)) {
    const std::complex<double> value = values(k);
    const double size = std::abs(value), percent = size > 0 ? -100 * value.real() / size : 0;
    const double imaginary = std::abs(value.imag());
    std::printf("  %16.8g %16.8g %14.8g %12.4g\n", value.real(), imaginary,
                imaginary / (2 * std::numbers::pi * second),
                std::abs(percent) < kNoise ? 0 : percent);
  }
}

Error not_run(double wanted, double first, double last) {
  char text[160];
  std::snprintf(text, sizeof text, "the deck runs from %.9g to %.9g: --time %.9g is not in between",
                first, last, wanted);
  return make_error(ErrorKind::argument, "BAD_TIME", text);
}

}  // namespace

int eig(const EigCommand& command) {
  InterruptGuard interrupt;
  const LoadReport report = load_path(command.deck, command.symbols);
  print_diagnostics(report.diagnostics, stderr);
  if (!report.ok()) return exit_code_of(report);
  const auto fail = [](const Error& error) {
    print_error(error, stderr);
    return exit_code_of(error);
  };
  auto simulation = Simulation::create(report.model, interrupt.token());
  if (!simulation) return fail(simulation.error());
  if (command.time) {
    const double first = (*simulation)->time(), last = (*simulation)->final_time();
    if (*command.time < first || *command.time > last)
      return fail(not_run(*command.time, first, last));
    const StepReport done = (*simulation)->run_exactly_until(*command.time, interrupt.token());
    if (done.error) return fail(*done.error);
    if (done.outcome == StepOutcome::interrupted) return kInterrupted;
    const double reached = (*simulation)->time();
    if (done.outcome == StepOutcome::finished &&
        reached + (*simulation)->next_step_size() <= *command.time)
      return fail(not_run(*command.time, first, reached));  // a drive ended the run
  }
  const UnitSystem* const units = find_part<UnitSystem>(*report.model);
  const double second = seconds_in_unit_of_time(units);
  const auto spectrum = eigen(linearize(*report.model, (*simulation)->state()), command.count,
                              {0, 2 * std::numbers::pi * command.shift * second});
  if (!spectrum) return fail(spectrum.error());
  print(spectrum->values, (*simulation)->time(), units);
  return kDone;
}

}  // namespace mbcosim::cli
