/// Runs a hydraulic deck given as text and keeps what it prints.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "deck_digits.h"
#include "elements/hydraulic_bench.h"
#include "output/record.h"
#include "output/result_writer.h"
#include "simulation/simulation.h"

namespace mbcosim::decks {

/// All columns of all lines of a run, by record.
class Recorder : public ResultWriter, public OutputRow {
 public:
  using Line = std::vector<double>;
  void begin(const Model&) override {}
  void derivatives(double, int, double) override {}
  void dummy_steps(double, int, double) override {}
  void step(const StepLine&) override {}
  void note(const std::string&) override {}
  void record(const EvalContext& context) override {
    records.emplace_back();
    write_record(context, *this);
  }
  Status finish() override { return ok(); }

  void begin(OutputFile file, int label) override {
    line_ = &records.back()[{extension(file), label}];
  }
  void begin_text(OutputFile file, std::string_view label) override {
    begin(file, std::stoi(std::string(label)));
  }
  void integer(int value) override { line_->push_back(value); }
  void scalar(const char*, const char*, double value) override { line_->push_back(value); }
  void vec3(const char*, const char*, const Vec3& x) override {
    line_->insert(line_->end(), x.data(), x.data() + 3);
  }
  void values(const char*, const char*, const double* d, int count) override {
    line_->insert(line_->end(), d, d + count);
  }
  void end() override {}

  std::vector<std::map<std::pair<std::string, int>, Line>> records;

 private:
  Line* line_ = nullptr;
};

/// What differs between the decks of these tests. The rest of the text is the same for all.
struct CircuitDeck {
  double h = 1e-3;
  int steps = 1;
  std::string method = "ms, .6";
  double tolerance = 1e-9, derivatives_tolerance = 1e-9;
  std::string counts;
  std::string nodes;
  std::string elements;

  std::string text() const;
};

/// The fluid of most reference runs, as text.
inline const char* const kOilText =
    "linear compressible, density, 870., 1.7052e9, 101325., viscosity, 0.0696";

class CircuitRun {
 public:
  /// Runs to the end of the deck; a failure to load or to converge fails the test.
  explicit CircuitRun(const CircuitDeck& deck) : CircuitRun(deck.text()) {}
  explicit CircuitRun(const std::string& text);

  /// Column `k` (from 0, after the label) of a line of record `step`.
  double at(std::size_t step, const char* file, int label, std::size_t k) const {
    if (step >= recorder->records.size()) {
      ADD_FAILURE() << "no record " << step;
      return std::nan("");
    }
    const auto line = recorder->records[step].find({file, label});
    if (line == recorder->records[step].end() || k >= line->second.size()) {
      ADD_FAILURE() << "no column " << k << " of " << file << " " << label;
      return std::nan("");
    }
    return line->second[k];
  }
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  std::unique_ptr<Simulation> simulation;
  StepReport report;
};

/// A column of a reference table: where to find it.
struct TableColumn {
  const char* file;
  int label;
  std::size_t column;
};

/// Rows of (step, value, value, ...) against the run, each column to `tolerance` relative to its
/// largest value in the table.
inline void expect_table(const CircuitRun& run, const std::vector<TableColumn>& columns,
                         const std::vector<std::vector<double>>& rows, double tolerance = 1e-6) {
  for (std::size_t c = 0; c < columns.size(); ++c) {
    double scale = 0;
    for (const auto& row : rows) scale = std::max(scale, std::abs(row.at(c + 1)));
    for (const auto& row : rows) {
      const TableColumn& t = columns[c];
      const double value = run.at(static_cast<std::size_t>(row[0]), t.file, t.label, t.column);
      EXPECT_NEAR(value, row[c + 1], tolerance * scale)
          << "step " << row[0] << ", ." << t.file << " " << t.label << " column " << t.column + 2;
    }
  }
}

inline std::string CircuitDeck::text() const {
  return "begin: data; problem: initial value; end: data;\n"
         "begin: initial value;\n  initial time: 0.; final time: " +
         digits(h * steps) + "; time step: " + digits(h) + "; method: " + method +
         ";\n  max iterations: 100; tolerance: " + digits(tolerance) +
         ";\n  derivatives coefficient: 1.e-6; derivatives max iterations: 50; derivatives "
         "tolerance: " +
         digits(derivatives_tolerance) +
         ";\nend: initial value;\n"
         "begin: control data; skip initial joint assembly; " +
         counts +
         " end: control data;\n"
         "begin: nodes;\n" +
         nodes + "end: nodes;\nbegin: elements;\n" + elements + "end: elements;\n";
}

inline CircuitRun::CircuitRun(const std::string& text) {
  const LoadReport loaded = load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd");
  for (const Diagnostic& d : loaded.diagnostics)
    if (d.severity == Severity::error) ADD_FAILURE() << d.text();
  if (!loaded.ok()) return;
  auto created = Simulation::create(loaded.model, nullptr, recorder);
  if (!created) {
    ADD_FAILURE() << created.error().message;
    return;
  }
  simulation = std::move(*created);
  report = simulation->run_until(1e30);
  EXPECT_EQ(report.outcome, StepOutcome::finished) << (report.error ? report.error->message : "");
}

}  // namespace mbcosim::decks
