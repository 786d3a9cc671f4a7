/// Where the processor time of a run goes, as one JSON object: reading, the phases before the first
/// step, the parts of all iterations, the rest of the steps, and the text of the results; with
/// allocations and memory.
///
///   run_parts DECK
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <vector>

#include "newton_parts.h"
#include "output/result_writer.h"
#include "output/text_writer.h"

namespace {
std::atomic<long> allocations{0};

void* counted(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }

namespace mbcosim::benchmarks {
namespace {

/// Of one run, in seconds of this thread and in allocations.
struct Phases {
  double start = 0, steps = 0;
  long start_allocations = 0, step_allocations = 0;
  std::int64_t matrices = 0;  ///< factored in steps
  StepReport report;
};

/// The shorter times of both, each on its own.
Phases shorter(const Phases& a, const Phases& b) {
  Phases s = a;
  s.start = std::min(a.start, b.start);
  s.steps = std::min(a.steps, b.steps);
  return s;
}

bool simulate(const ModelPtr& model, std::shared_ptr<ResultWriter> writer, Phases& phases) {
  double begin = thread_time();
  long before = allocations;
  auto simulation = Simulation::create(model, nullptr, writer);
  if (!simulation) return false;
  phases.start = thread_time() - begin;
  phases.start_allocations = allocations - before;
  const std::int64_t factored = (*simulation)->factorizations();
  begin = thread_time();
  before = allocations;
  while (!(*simulation)->finished()) {
    phases.report.add((*simulation)->step_many(1000));
    if (phases.report.error) return false;
  }
  if (writer && !writer->finish()) return false;
  phases.steps = thread_time() - begin;
  phases.step_allocations = allocations - before;
  phases.matrices = (*simulation)->factorizations() - factored;
  return true;
}

/// The parts of an iteration a tenth of the way, when no model is at rest in its initial state.
std::optional<std::array<double, kNewtonParts>> parts(const ModelPtr& model, std::int64_t steps) {
  auto simulation = Simulation::create(model);
  if (!simulation || (*simulation)->step_many(std::max<std::int64_t>(1, steps / 10)).error)
    return std::nullopt;
  return newton_parts(**simulation, 0.05);
}

int run(const std::filesystem::path& deck) {
  constexpr int kRepeats = 5;
  const FolderSource folder(deck.parent_path().string(), true);
  const std::string name = deck.filename().string();
  LoadReport read;
  double read_time = HUGE_VAL;
  long read_allocations = 0;
  for (int k = 0; k < kRepeats; ++k) {
    const double begin = thread_time();
    const long before = allocations;
    read = load_deck(folder, name);
    read_time = std::min(read_time, thread_time() - begin);
    read_allocations = allocations - before;
  }
  if (!read.ok()) return std::fprintf(stderr, "run_parts: %s is refused\n", name.c_str()), 1;
  const auto scratch =
      std::filesystem::temp_directory_path() / ("run_parts." + std::to_string(getpid()));
  std::filesystem::create_directory(scratch);
  Phases silent, written;
  bool fine = true;
  for (int k = 0; k < kRepeats && fine; ++k) {
    Phases without, with;
    fine = simulate(read.model, nullptr, without) &&
           simulate(read.model, make_text_writer((scratch / "result").string(), nullptr), with);
    silent = k == 0 ? without : shorter(silent, without);
    written = k == 0 ? with : shorter(written, with);
  }
  std::filesystem::remove_all(scratch);
  const auto each = fine ? parts(read.model, silent.report.steps_done) : std::nullopt;
  if (!each) return std::fprintf(stderr, "run_parts: %s does not run\n", name.c_str()), 1;

  const double iterations = static_cast<double>(silent.report.total_iterations);
  const double residuals = iterations + static_cast<double>(silent.report.steps_done);
  const double matrices = static_cast<double>(silent.matrices);
  const double counts[kNewtonParts] = {residuals, matrices, matrices, iterations};
  double rest = silent.steps;
  std::printf("{\"read\": %.4g, \"initial\": %.4g", 1e3 * read_time, 1e3 * silent.start);
  for (int k = 0; k < kNewtonParts; ++k) {
    const double time = counts[k] * (*each)[k];
    rest -= time;
    std::printf(", \"%s\": %.4g", kNewtonPartNames[k], 1e3 * time);
  }
  rusage used;
  getrusage(RUSAGE_SELF, &used);
  std::printf(
      ", \"rest\": %.4g, \"output\": %.4g, \"iterations\": %.0f, \"read_allocations\": %ld, "
      "\"initial_allocations\": %ld, \"step_allocations\": %ld, \"memory_MB\": %.4g}\n",
      1e3 * rest, 1e3 * (written.start + written.steps - silent.start - silent.steps), iterations,
      read_allocations, silent.start_allocations, silent.step_allocations,
      static_cast<double>(used.ru_maxrss) / 1024);
  return 0;
}

}  // namespace
}  // namespace mbcosim::benchmarks

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: run_parts DECK\n"), 2;
  return mbcosim::benchmarks::run(std::filesystem::absolute(argv[1]));
}
