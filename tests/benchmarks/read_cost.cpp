/// Time and memory of reading a deck and building its model, by size: n nodes and n bodies, 250
/// bytes a pair.
///
/// Aim: n = 100 000 (25 MB) in at most 5 s, in memory that grows linearly. The last two benchmarks
/// write the same model with a loop, and constraints with run-time strings instead of bodies.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <cstdio>
#include <string>

#include "simulation/simulation.h"

namespace {

using namespace mbcosim;

std::string framed(const std::string& nodes, const std::string& elements) {
  return "begin: data; problem: initial value; end: data;\n"
         "begin: initial value; time step: 1e-3; final time: 1.; end: initial value;\n"
         "begin: control data; skip initial joint assembly; end: control data;\n"
         "begin: nodes;\n" +
         nodes + "end: nodes;\nbegin: elements;\n" + elements + "end: elements;\n";
}

template <class... Arguments>
void append(std::string& text, const char* format, Arguments... arguments) {
  char line[400];
  text.append(line, std::snprintf(line, sizeof line, format, arguments...));
}

std::string node_cards(int n) {
  std::string text;
  for (int k = 1; k <= n; ++k)
    append(
        text,
        "    structural: %d, dynamic,\n        %.8f, %.8f, %.8f,\n        euler, 0.1, 0.2, %.2f,\n"
        "        null,\n        null;\n",
        k, k * 0.01, k % 97 * 0.013, k % 31 * 0.017, k % 7 * 0.1);
  return text;
}

std::string bodies(int n) {
  std::string text;
  for (int k = 1; k <= n; ++k)
    append(text,
           "    body: %d, %d,\n        %.6f*1.e-3,\n        reference, node, 0.01, 0., 0.,\n"
           "        diag, 1.e-3, 2.e-3, 3.e-3;\n",
           k, k, 1 + k % 13 * 0.1);
  return framed(node_cards(n), text);
}

std::string forces_with_strings(int n) {
  std::string text;
  for (int k = 1; k <= n; ++k)
    append(text,
           "    force: %d, absolute, %d, position, null, 0., 0., 1., string, \"%d.*sin(Time) + "
           "Step\";\n",
           k, k, k % 17);
  return framed(node_cards(n), text);
}

std::string loop(int n) {
  const std::string head = "    for: integer k = 1, " + std::to_string(n) + ";\n";
  return framed(head +
                    "    structural: k, dynamic, k*0.01, 0., 0., euler, 0.1, 0.2, 0.3, null, "
                    "null;\n    end for;\n",
                head +
                    "    body: k, k, 1.e-3, reference, node, 0.01, 0., 0., diag, 1., 2., 3.;\n    "
                    "end for;\n");
}

void read(benchmark::State& state, std::string (*make)(int)) {
  const int n = static_cast<int>(state.range(0));
  const std::string text = make(n);
  const BundleSource files({{"deck.mbd", text}});
  std::size_t used = 0;
  for (auto _ : state) {
    const std::size_t before = mallinfo2().uordblks;
    const LoadReport report = load_deck(files, "deck.mbd");
    if (!report.model) {
      state.SkipWithError(report.diagnostics.at(0).text().c_str());
      return;
    }
    used = mallinfo2().uordblks + mallinfo2().hblkhd - before;
  }
  state.SetComplexityN(n);
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * text.size()));
  state.counters["deck_MB"] = static_cast<double>(text.size()) * 1e-6;
  state.counters["model_B_per_node"] = static_cast<double>(used) / n;
}

void sizes(benchmark::internal::Benchmark* b) {
  b->ArgsProduct({{12'500, 25'000, 50'000, 100'000}})->Unit(benchmark::kMillisecond)->Complexity();
}

BENCHMARK_CAPTURE(read, bodies, bodies)->Apply(sizes);
BENCHMARK_CAPTURE(read, loop, loop)->Apply(sizes);
BENCHMARK_CAPTURE(read, forces_with_strings, forces_with_strings)->Apply(sizes);

}  // namespace
