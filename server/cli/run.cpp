
#include "cli/commands.h"
#include "cli/deck_report.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "output/result_files.h"

namespace mbcosim::cli {
namespace {

StepReport run_to_end(Simulation& simulation, const CancelToken* cancel, bool quiet) {
  const double final_time = simulation.model().initial_value.final_time;
  Progress progress(stderr, simulation.time(), final_time);
  if (quiet || !progress.visible()) return simulation.run_until(final_time, cancel);
  StepReport total, last;
  do {
    last = simulation.step(cancel);
    last.steps_done += total.steps_done;
    last.total_iterations += total.total_iterations;
    last.solver_seconds += total.solver_seconds;
    total = last;
    progress.update(total);
  } while (total.outcome == StepOutcome::accepted);
  progress.clear();
  if (total.outcome == StepOutcome::finished) {
    std::fprintf(stderr, "done: %lld steps, %lld iterations, t = %.10g s, %.3f s in the solver\n",
                 static_cast<long long>(total.step), static_cast<long long>(total.total_iterations),
                 total.time, total.solver_seconds);
  }
  return total;
}

ExitCode complain(const Error& error) {
  print_error(error, stderr);
  return exit_code_of(error);
}

ExitCode simulate(const ModelPtr& model, const std::shared_ptr<ResultWriter>& writer,
                  const CancelToken* cancel, bool quiet) {
  auto simulation = Simulation::create(model, cancel, writer);
  if (!simulation) return complain(simulation.error());
  if ((*simulation)->finished()) return kDone;
  const StepReport done = run_to_end(**simulation, cancel, quiet);
  if (done.error) return complain(*done.error);
  return done.outcome == StepOutcome::interrupted ? kInterrupted : kDone;
}

}  // namespace

int run(const RunOptions& options) {
  InterruptGuard interrupt;
  const LoadReport report = load_path(options.deck);
  std::fputs(report.printed.c_str(), stdout);
  print_diagnostics(report.diagnostics, stderr);
  if (!report.ok()) return exit_code_of(report);
  for (const StructuralPort& port : report.model->structural_ports)
    std::fprintf(stderr, "note: nobody is coupled to port \"%s\"; its loads stay zero\n",
                 port.name.c_str());

  const auto writer =
      make_result_writer(*report.model, options.prefix.empty() ? options.deck : options.prefix);
  const ExitCode exit_code = simulate(report.model, writer, interrupt.token(), options.quiet);
  const auto written = writer->finish();
  if (!written) return complain(written.error());
  return exit_code;
}

}  // namespace mbcosim::cli
