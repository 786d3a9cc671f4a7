/// Rows of numbers that elements write to files of their own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/model.h"
#include "model/sampled_table.h"
#include "output/text_file.h"

namespace mbcosim {

/// Of the files of `SampleFiles`.
std::vector<std::string> sample_paths(const Model& model, const std::string& prefix);

/// PREFIX.<file> for each table of the model: a row for each sample, six digits in fields of 16
/// columns (MBDyn's format of identified models).
class SampleFiles {
 public:
  void open(const Model& model, const std::string& prefix, ResultBudget* budget);
  /// The rows of the elements that took a sample since the last call.
  void write(const State& state);
  /// After the files were cut: what `state` has taken is written.
  void go_back(const State& state);
  /// Calls `action` with each file.
  template <class Action>
  void each(Action&& action) const {
    for (const auto& table : tables_) action(table->file);
  }

 private:
  struct Table {
    SampledTable source;
    double written = 0;  ///< number of samples at the last row
    TextFile file;
  };
  std::vector<std::unique_ptr<Table>> tables_;
};

}  // namespace mbcosim
