/// Where a run's results go.
#pragma once

#include <cstdint>

#include "model/diagnostic.h"
#include "model/eigen_report.h"
#include "model/model.h"

namespace mbcosim {

/// One line of the run log.
struct StepLine {
  std::int64_t step = 0;
  double time = 0, h = 0;  ///< [s]
  int iterations = 0;
  double residual_error = 0, solution_error = 0;
  bool by_solution = false;  ///< accepted by the solution test
  bool recorded = false;     ///< results were written for this step
};

class ResultWriter {
 public:
  virtual ~ResultWriter() = default;
  /// Before anything else.
  virtual void begin(const Model& model) = 0;
  virtual void derivatives(double time, int iterations, double error) = 0;
  virtual void dummy_steps(double time, int iterations, double error) = 0;
  virtual void step(const StepLine& line) = 0;
  /// Free text for the run log, e.g. an eigenanalysis table.
  virtual void note(const std::string& text) = 0;
  /// An eigenanalysis of the deck; `model` is the one of `begin`.
  virtual void eigenanalysis(const EigenReport&) {}
  /// One record: everything that has its output switched on, at the state in `context`.
  virtual void record(const EvalContext& context) = 0;
  /// After the initial solution and every accepted step: rows of elements that took samples.
  virtual void samples(const EvalContext&) {}
  /// ErrorKind::io, with the path and the reason, when something could not be written so far.
  virtual Status status() const { return ok(); }
  /// Flushes; ErrorKind::io when something could not be written (now or earlier).
  virtual Status finish() = 0;
};

}  // namespace mbcosim
