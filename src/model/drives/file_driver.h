/// File drivers: named sources of channels of values in time. MBDyn input manual, "File drivers".
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/drive.h"
#include "model/fwd.h"

namespace mbcosim {

class FileDriver {
 public:
  virtual ~FileDriver() = default;
  virtual int channels() const = 0;
  /// Value of `channel` (from 0) at time t; throws EvaluationError.
  virtual double value(const EvalContext& context, int channel, double t) const = 0;
};

/// Samples of several channels at increasing instants.
struct SampleTable {
  int channels = 1;
  std::vector<double> times;   ///< (rows), empty when evenly spaced
  double t0 = 0, dt = 1;       ///< of evenly spaced samples [s]
  std::vector<double> values;  ///< (rows × channels), by rows

  int rows() const { return static_cast<int>(values.size()) / channels; }
  double time(int row) const { return times.empty() ? t0 + row * dt : times[row]; }
  /// Last row at or before t, within 0 … rows − 1.
  int row_before(double t) const;
};

/// How a table is read between and outside its samples.
struct TableOptions {
  bool linear = true;     ///< else: the last sample
  bool pad_zeros = true;  ///< 0 outside the table; else the first or last sample
  bool bail_lower = false, bail_upper = false;  ///< leaving the table on that side ends the run
};

/// `fixed step` and `variable step` drivers.
///
/// N.B. a padded `variable step` table is zero also at its first and last instants, a `fixed step`
/// one is not.
class TableDriver : public FileDriver {
 public:
  TableDriver(SampleTable table, TableOptions options)
      : table_(std::move(table)), options_(options) {}
  int channels() const override { return table_.channels; }
  double value(const EvalContext& context, int channel, double t) const override;
  /// Throws EndOfRun when the table is left at time t on a side with `bailout`.
  void check(double t) const;

 private:
  double sample(int row, int channel) const {
    return table_.values[row * table_.channels + channel];
  }
  SampleTable table_;
  TableOptions options_;
};

/// A table with `bailout` ends the run also where nothing asks for its values.
class TableWatch : public StepListener {
 public:
  explicit TableWatch(std::shared_ptr<const TableDriver> table) : table_(std::move(table)) {}
  void advance(const EvalContext& context, State& state, bool initial) const override;

 private:
  std::shared_ptr<const TableDriver> table_;
};

/// Values received from a peer, kept in State::memory; they hold until new ones arrive.
class StreamDriver : public FileDriver {
 public:
  StreamDriver(int channels, int memory) : channels_(channels), memory_(memory) {}
  int channels() const override { return channels_; }
  double value(const EvalContext& context, int channel, double t) const override;

 private:
  int channels_;
  int memory_;  ///< offset in State::memory (channels)
};

/// Rows of a sample file: numbers separated by blanks or commas, one row a line; from `#` on it is
/// a comment.
struct SampleText {
  std::vector<double> values;  ///< (rows × columns), by rows
  int rows = 0;
  std::string initial_time, time_step;  ///< texts of `# initial time: …` and `# time step: …`
  std::string error;  ///< what is wrong with the text, with its line; empty: nothing
};
SampleText parse_samples(const std::string& text, int columns);

}  // namespace mbcosim
