#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/commands.h"
#include "cli/deck_report.h"
#include "cli/heap.h"
#include "cli/pace.h"
#include "cli/progress.h"
#include "host/control_group.h"
#include "input/sources.h"
#include "mbdyn/channels.h"
#include "output/dof_text.h"
#include "output/result_files.h"
#include "solver/linear_solver.h"
#include "threads/interrupt.h"

namespace mbcosim::cli {
namespace {

void tell(const Pace& pace, std::int64_t steps) {
  if (pace.late() > 0)
    std::fprintf(stderr, "note: %lld of %lld steps ended late, the latest by %.3g s\n",
                 static_cast<long long>(pace.late()), static_cast<long long>(steps),
                 pace.worst_delay());
}

/// Step by step, shown and held back as the options say, until one is not accepted or `is_enough`.
template <class Step, class IsEnough>
StepReport take_steps(const Simulation& simulation, const CancelToken* cancel,
                      const RunOptions& options, Step step, IsEnough is_enough) {
  Progress progress(stderr, simulation.time(), simulation.model().initial_value.final_time);
  const bool visible = !options.quiet && progress.visible();
  Pace pace(simulation.time());
  StepReport total;
  do {
    total.add(step());
    if (options.real_time) pace.wait_for(total.time, cancel);
    if (visible) progress.update(total);
  } while (total.outcome == StepOutcome::accepted && !is_enough());
  if (options.real_time) tell(pace, total.steps_done);
  if (!visible) return total;
  progress.clear();
  if (total.outcome == StepOutcome::finished) {
    std::fprintf(stderr, "done: %lld steps, %lld iterations, t = %.10g s, %.3f s in the solver\n",
                 static_cast<long long>(total.step), static_cast<long long>(total.total_iterations),
                 total.time, total.solver_seconds);
  }
  return total;
}

StepReport run_to_end(Simulation& simulation, const CancelToken* cancel,
                      const RunOptions& options) {
  const double final_time = simulation.model().initial_value.final_time;
  const bool watched = !options.quiet && Progress(stderr, simulation.time(), final_time).visible();
  if (!watched && !options.real_time) return simulation.run_until(final_time, cancel);
  return take_steps(
      simulation, cancel, options, [&] { return simulation.step(cancel); }, [] { return false; });
}

/// There is no step to make, and the user may not expect that.
void tell_of_no_step(const InitialValueSettings& s) {
  if (s.abort_after == InitialValueSettings::AbortAfter::never)
    std::fprintf(stderr,
                 "note: no step was made: the final time, %g s (0 without the card `final time`), "
                 "is not after the initial one\n"
                 "  hint: write a later `final time`, or `final time: forever`\n",
                 s.final_time);
}

void tell_of_early_end(const StepReport& done, const InitialValueSettings& s) {
  if (done.outcome == StepOutcome::finished && done.time < s.final_time)
    std::fprintf(stderr, "note: the run ended at t = %.9g; the reason stands in its .out file\n",
                 done.time);
}

ExitCode complain(const Error& error) {
  print_error(error, stderr);
  return exit_code_of(error);
}

/// As the options say, or all that are of use to the model.
int threads_for(const Model& model, const RunOptions& options) {
  if (options.threads > 0) return options.threads;
  return LinearSolver::threads_of_use(model.unknowns) == 1 ? 1 : server::usable_cores();
}

ExitCode simulate(const ModelPtr& model, const std::shared_ptr<ResultWriter>& writer,
                  const CancelToken* cancel, const RunOptions& options) {
  const auto simulation = Simulation::prepare(model, writer);
  simulation->set_threads(threads_for(*model, options));
  if (const auto started = simulation->start(cancel); !started) return complain(started.error());
  if (simulation->finished()) {
    tell_of_no_step(model->initial_value);
    return kDone;
  }
  const StepReport done = run_to_end(*simulation, cancel, options);
  if (done.error) return complain(*done.error);
  tell_of_early_end(done, model->initial_value);
  return done.outcome == StepOutcome::interrupted ? kInterrupted : kDone;
}

bool is_channel(const std::vector<const DeckChannel*>& channels, const std::string& port) {
  return std::any_of(channels.begin(), channels.end(),
                     [&](const DeckChannel* channel) { return channel->port == port; });
}

ExitCode simulate_coupled(const ModelPtr& model, const std::shared_ptr<ResultWriter>& writer,
                          const InterruptGuard& interrupt, const RunOptions& options) try {
  const CancelToken* cancel = interrupt.token();
  const auto simulation = Simulation::prepare(model, writer);
  simulation->set_threads(threads_for(*model, options));
  mbdyn::Patience patience;
  patience.time = std::chrono::milliseconds(std::llround(1000 * options.peer_timeout));
  patience.cancelled = [cancel] { return cancel->cancelled(); };
  mbdyn::Channels channels(deck_channels(*model), *simulation, patience, options.pads_labels);
  if (const auto started = channels.start(cancel); !started) return complain(started.error());
  if (simulation->finished()) {
    tell_of_no_step(model->initial_value);
    return kDone;
  }
  const StepReport done = take_steps(
      *simulation, cancel, options, [&] { return channels.step(cancel); },
      [&] { return channels.wants_end().has_value(); });
  if (done.error) return complain(*done.error);
  if (done.outcome == StepOutcome::interrupted) return kInterrupted;
  if (const auto name = channels.wants_end()) {
    std::fprintf(stderr, "%s: the peer ended the run at t = %.10g s\n", name->c_str(),
                 simulation->time());
    return kPeerLost;
  }
  tell_of_early_end(done, model->initial_value);
  return kDone;
} catch (const mbdyn::ChannelLost& lost) {
  if (interrupt.token()->cancelled()) return kInterrupted;
  std::fprintf(stderr, "error: %s\n", lost.what());
  return kPeerLost;
}

/// Those of the command line; without them, those of the deck.
std::vector<ResultFormat> formats_of(const RunOptions& options, const Model& model) {
  if (options.formats.empty()) return result_formats(model);
  std::vector<ResultFormat> formats;
  for (const std::string& name : options.formats)
    formats.push_back(name == "text" ? ResultFormat::text : ResultFormat::netcdf);
  return formats;
}

/// As MBDyn names them: after the deck, without its ending; `-o` may be a folder for such files.
std::string prefix_of(const RunOptions& options) {
  namespace fs = std::filesystem;
  const fs::path deck = fs::path(options.deck).replace_extension();
  if (options.prefix.empty()) return deck.string();
  std::error_code none;
  if (options.prefix.back() != '/' && !fs::is_directory(options.prefix, none))
    return options.prefix;
  return (fs::path(options.prefix) / deck.filename()).string();
}

/// ErrorKind::argument when the run would write over, or remove, one of the files `read`.
Status check_inputs(const std::vector<std::string>& read, const std::vector<std::string>& results,
                    const std::vector<const DeckChannel*>& channels) {
  if (const std::string input = file_in_both(read, results); !input.empty())
    return make_error(ErrorKind::argument, "",
                      "the results would overwrite \"" + input +
                          "\", which the deck consists of\n"
                          "  hint: choose other names with `-o PREFIX`");
  for (const DeckChannel* channel : channels)
    if (const auto input = file_in_both(read, mbdyn::files_changed_by(*channel)); !input.empty())
      return make_error(ErrorKind::argument, "",
                        channel->card + " would overwrite or remove \"" + input +
                            "\", which the deck consists of\n"
                            "  hint: give the files that this card names other names");
  return ok();
}

// Of a small model, clearing one huge page takes longer than all of its memory.
constexpr std::uintmax_t kLongDeck = 32 << 10;  ///< [bytes]
constexpr int kManyUnknowns = 500;

/// A pipe's name is no name for results.
bool needs_prefix(const RunOptions& options) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (!is_piped(options.deck)) return false;
  return options.prefix.empty() || options.prefix.back() == '/' ||
         fs::is_directory(options.prefix, none);
}

std::uintmax_t size_of(const std::string& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  return error ? 0 : size;
}

}  // namespace

int run(const RunOptions& options) {
  begin_heap();
  if (needs_prefix(options))
    return complain(make_error(ErrorKind::argument, "",
                               "a deck from a pipe has no name for its results\n"
                               "  hint: give them one with `-o PREFIX`"));
  InterruptGuard interrupt;
  const bool is_long = size_of(options.deck) > kLongDeck;
  if (is_long) keep_heap();
  std::vector<std::string> read;
  const LoadReport report = load_path(options.deck, options.symbols, &read);
  std::fputs(report.printed.c_str(), stdout);
  print_diagnostics(report.diagnostics, stderr);
  if (!report.ok()) return exit_code_of(report);
  if (has_nothing_to_run(report)) {
    print_nothing_to_run(options.deck, Severity::error, stderr);
    return kDeckRefused;
  }
  if (!is_long && report.model->unknowns > kManyUnknowns) keep_heap();
  const std::vector<const DeckChannel*> channels = deck_channels(*report.model);
  const bool coupled = options.deck_sockets && !channels.empty();
  for (const StructuralPort& port : report.model->structural_ports)
    if (!coupled || !is_channel(channels, port.name))
      std::fprintf(stderr, "note: nobody is coupled to port \"%s\"; its loads stay zero\n",
                   port.name.c_str());

  if (!has_dof_file(*report.model)) std::fputs(dof_text(*report.model).c_str(), stdout);
  const auto writer =
      make_result_writer(formats_of(options, *report.model), prefix_of(options), nullptr);
  const auto kept = check_inputs(read, writer->paths(*report.model),
                                 coupled ? channels : std::vector<const DeckChannel*>{});
  if (!kept) return complain(kept.error());
  const ExitCode exit_code = coupled ? simulate_coupled(report.model, writer, interrupt, options)
                                     : simulate(report.model, writer, interrupt.token(), options);
  const bool said = !writer->status();
  const auto written = writer->finish();
  if (!written && !said) complain(written.error());
  return written ? exit_code : kRefused;
}

}  // namespace mbcosim::cli
