#include "model/sampled_table.h"

#include "model/output_row.h"

namespace mbcosim {

bool is_table_name(const std::string& file) {
  if (file.empty() || file == "." || file == "..") return false;
  for (const char c : file)
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < ' ') return false;
  for (int k = 0; k < static_cast<int>(OutputFile::count); ++k)
    if (file == extension(static_cast<OutputFile>(k))) return false;
  return file != "out" && file != "log" && file != "nc";
}

}  // namespace mbcosim
