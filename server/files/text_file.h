/// Texts of files that options name.
#pragma once

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace mbcosim::server {

/// The whole of it; without a name, nothing. Throws std::runtime_error.
inline std::string text_of_file(const std::string& path) {
  if (path.empty()) return "";
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (!file) throw std::runtime_error("cannot read \"" + path + "\"");
  return text;
}

}  // namespace mbcosim::server
