#include <unistd.h>

#include <filesystem>

#include "cli/commands.h"
#include "cli/fem_file.h"
#include "cli/heap.h"
#include "host/control_group.h"
#include "input/sources.h"
#include "reduction/job.h"
#include "threads/interrupt.h"

namespace fs = std::filesystem;

namespace mbcosim::cli {
namespace {

constexpr int kBarWidth = 30;

/// A file of the user's own, relative to `folder`.
std::string read_file(const std::string& folder, const std::string& name) {
  auto text = FolderSource(folder, true).read(name);
  if (!text) throw ReductionError(ErrorKind::io, text.error().message);
  return std::move(*text);
}

/// The job file first, then what the command line says.
ReductionJob read_command(const ReduceCommand& command) {
  ReductionJob job;
  if (!command.job.empty()) read_job(command.job, read_file(".", command.job), job);
  ReductionNames names;
  for (const auto& [name, value] : command.options) {
    names.add(name);
    job.set(name, value);
    if (const auto file = job.files.find(name); file != job.files.end()) {
      if (value.empty()) refuse_reduction("--" + name + ": a file's name expected");
      file->second = fs::absolute(value).string();
    }
  }
  return job;
}

/// The results would take the place of what they are made of.
void check_output(const ReduceCommand& command, const ReductionJob& job,
                  const std::string& folder) {
  std::vector<fs::path> inputs;
  if (!command.job.empty()) inputs.emplace_back(command.job);
  for (const auto& [name, file] : job.files)
    if (!file.empty()) inputs.push_back(fs::path(folder) / file);
  for (const std::string& output : {command.output, command.output + ".json"})
    for (const fs::path& input : inputs) {
      std::error_code none;
      if (fs::equivalent(output, input, none))
        refuse_reduction("the output \"" + output + "\" is one of the inputs",
                         "choose another name with -o");
    }
}

/// A line on the terminal that shows the phase and how far it is.
class PhaseBar {
 public:
  explicit PhaseBar(bool visible) : visible_(visible) {}
  void show(const std::string& phase, double fraction) {
    const int filled = static_cast<int>(fraction * kBarWidth);
    if (!visible_ || (phase == phase_ && filled == filled_)) return;
    phase_ = phase;
    filled_ = filled;
    std::fprintf(stderr, "\r%-18s [%s%s]", phase.c_str(), std::string(filled, '#').c_str(),
                 std::string(kBarWidth - filled, ' ').c_str());
    std::fflush(stderr);
  }
  void clear() const {
    if (visible_) std::fprintf(stderr, "\r%*s\r", kBarWidth + 22, "");
  }

 private:
  bool visible_;
  std::string phase_;
  int filled_ = -1;
};

ExitCode tell(const Error& error) {
  std::fprintf(stderr, "error: %s\n", error.message.c_str());
  switch (error.kind) {
    case ErrorKind::argument:
    case ErrorKind::io:
      return kDeckRefused;
    case ErrorKind::cancelled:
      return kInterrupted;
    case ErrorKind::limit:
      return kRefused;
    default:
      return kNumericalFailure;
  }
}

}  // namespace

int reduce_model(const ReduceCommand& command) {
  InterruptGuard interrupt;
  keep_heap();
  Error error;
  try {
    ReductionJob job = read_command(command);
    job.options.threads = command.threads > 0 ? command.threads : server::usable_cores();
    const std::string folder = fs::path(command.job).parent_path().string();
    check_output(command, job, folder);
    const FeModel model = load_model(job, [&](const std::string& name) {
      return read_file(folder.empty() ? "." : folder, name);
    });
    std::string last_phase;
    PhaseBar bar(!command.quiet && ::isatty(STDERR_FILENO));
    const auto reduction =
        reduce(model, job.options, [&](const std::string& phase, double fraction) {
          if (phase != last_phase) trim_heap();  // what reading the files or another phase took
          last_phase = phase;
          bar.show(phase, fraction);
          return !interrupt.token()->cancelled();
        });
    bar.clear();
    if (!reduction) return tell(reduction.error());
    write_fem_file(command.output, reduction->data, reduction->comments);
    write_file(command.output + ".json", report_json(*reduction) + "\n");
    if (!command.quiet) std::fputs(report_text(*reduction).c_str(), stdout);
    return kDone;
  } catch (const ReductionError& e) {
    error.kind = e.kind;
    error.message = e.what();
  }
  return tell(error);
}

}  // namespace mbcosim::cli
