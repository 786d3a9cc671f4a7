/// Where a run's results go.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

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
  /// Paths of all files that a run of `model` may write.
  virtual std::vector<std::string> paths(const Model&) const { return {}; }
  /// Before anything else.
  virtual void begin(const Model& model) = 0;
  virtual void derivatives(double time, int iterations, double error) = 0;
  virtual void dummy_steps(double time, int iterations, double error) = 0;
  /// In place of the two before: the run begins at a state that another one came to.
  virtual void begin_at(std::int64_t /*step*/, double /*time*/) {}
  virtual void step(const StepLine& line) = 0;
  /// Free text for the run log, e.g. an eigenanalysis table.
  virtual void note(const std::string& text) = 0;
  /// An eigenanalysis of the deck; `model` is the one of `begin`.
  virtual void eigenanalysis(const EigenReport&) {}
  /// One record: everything that has its output switched on, at the state in `context`.
  virtual void record(const EvalContext& context) = 0;
  /// After the initial solution and every accepted step: rows of elements that took samples.
  virtual void samples(const EvalContext&) {}
  /// ErrorKind::io with the path and the reason, or ErrorKind::limit, when something could not be
  /// written so far.
  virtual Status status() const { return ok(); }

  // --- for runs that go back to an earlier state, or on with files of an earlier process
  /// In place of `begin`: goes on with the files of this name. `go_back` follows.
  virtual void resume(const Model& model) { begin(model); }
  /// Appends where each file ends, always as many numbers.
  virtual void positions(std::vector<std::int64_t>&) const {}
  /// Cuts every file to where it ended then; takes as many from `positions` as it appended.
  /// `context`: the state of that time.
  virtual Status go_back(std::span<const std::int64_t>&, const EvalContext&) { return ok(); }
  /// The simulation stands at another state than the last one that was told.
  virtual Status restored(const EvalContext&) { return ok(); }
  /// All so far is in the files; with `to_disk` it survives a failure of power, too. What could not
  /// be written before is tried again.
  virtual Status flush(bool /*to_disk*/) { return status(); }
  /// Bytes that wait to be written.
  virtual std::int64_t waiting() const { return 0; }

  /// Flushes; ErrorKind::io when something could not be written (now or earlier).
  virtual Status finish() = 0;
};

/// ErrorKind::io for the first of these files that exists and cannot be written; creates nothing.
Status check_writable(const std::vector<std::string>& paths);

}  // namespace mbcosim
