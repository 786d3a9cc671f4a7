#include "cli/fem_file.h"

#include <fstream>

#include "reduction/error.h"

namespace mbcosim::cli {

void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw ReductionError(ErrorKind::io, "cannot write " + path);
}

void write_fem_file(const std::string& path, const FemData& data,
                    const std::vector<std::string>& comments) {
  write_file(path,
             path.ends_with(".bin") ? write_fem_binary(data) : write_fem_text(data, comments));
}

}  // namespace mbcosim::cli
