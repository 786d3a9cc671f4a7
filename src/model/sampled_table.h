/// Rows of numbers that elements write to files of their own.
#pragma once

#include <string>
#include <vector>

namespace mbcosim {

/// A row for each sample that an element takes.
struct SampledTable {
  std::string file;  ///< behind the prefix of the result files: PREFIX.<file>
  /// Offsets in State::memory: the number of samples taken so far, the latest row.
  int samples = 0, first = 0;
  int count = 0;  ///< numbers of a row
};

/// A set whose elements may have tables.
class SampledTableSource {
 public:
  virtual ~SampledTableSource() = default;
  virtual std::vector<SampledTable> sampled_tables() const = 0;
};

/// Is PREFIX.<file> no other result file's name, and no folder's?
bool is_table_name(const std::string& file);

}  // namespace mbcosim
