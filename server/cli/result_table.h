/// Result files of a run, as `mbcosim run` and MBDyn write them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/diagnostic.h"

namespace mbcosim::cli {

/// One text file: by label, the numbers of each record, one row after the other.
struct ResultTable {
  std::string path;
  std::map<int, std::vector<std::vector<double>>> rows;  ///< without the label
};

/// Endings of the tables among the files PREFIX.*, sorted: "jnt", "mov", …
std::vector<std::string> table_endings(const std::string& prefix);

/// Why there are none.
Error no_tables(const std::string& prefix);

/// The table PREFIX.`ending`; ErrorKind::io or argument with the place.
Result<ResultTable> read_table(const std::string& prefix, const std::string& ending);

/// Instants of the records [s], from PREFIX.out.
Result<std::vector<double>> read_times(const std::string& prefix);

/// How PREFIX.mov writes the orientations of nodes, by label, from PREFIX.log: "euler123", "phi",
/// "mat", ... Empty where there is no such file.
std::map<int, std::string> read_orientations(const std::string& prefix);

}  // namespace mbcosim::cli
