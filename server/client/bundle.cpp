#include "client/bundle.h"

#include <grpcpp/support/status_code_enum.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "client/mbcosim_client.h"

namespace mbcosim::client {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::error_code error;
  std::ifstream file(path, std::ios::binary);
  if (!file || !fs::is_regular_file(path, error)) {
    const std::string why = file ? "it is no regular file" : std::strerror(errno);
    throw Error("cannot open \"" + path.string() + "\": " + why,
                static_cast<int>(grpc::StatusCode::NOT_FOUND), "", {});
  }
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Texts in quotes on one line, not longer than a path may be.
std::vector<std::string> quoted_texts(const std::string& text) {
  constexpr std::size_t kLongest = 1000;
  std::vector<std::string> found;
  std::size_t open = text.find('"');
  while (open != std::string::npos) {
    const std::size_t close = text.find_first_of("\"\n", open + 1);
    if (close == std::string::npos) break;
    const bool is_name = text[close] == '"' && close > open + 1 && close - open <= kLongest;
    if (is_name) found.push_back(text.substr(open + 1, close - open - 1));
    open = text.find('"', is_name ? close + 1 : open + 1);
  }
  return found;
}

/// Name within the bundle, or empty when the text names no file below the folder.
std::string name_in_bundle(const fs::path& folder, const fs::path& base, const std::string& text) {
  const fs::path name = (base / text).lexically_normal();
  if (name.empty() || name.is_absolute() || *name.begin() == "..") return "";
  std::error_code error;
  const fs::path found = fs::canonical(folder / name, error);
  if (error || !fs::is_regular_file(found, error)) return "";
  const fs::path inside = found.lexically_relative(folder);
  if (inside.empty() || *inside.begin() == "..") return "";
  return name.generic_string();
}

}  // namespace

std::map<std::string, std::string> collect_bundle(const std::string& folder,
                                                  const std::string& main) {
  std::error_code error;
  const fs::path root = fs::canonical(folder.empty() ? "." : folder, error);
  if (error)
    throw Error("cannot open \"" + (fs::path(folder) / main).string() + "\": " + error.message(),
                static_cast<int>(grpc::StatusCode::NOT_FOUND), "", {});
  std::map<std::string, std::string> files;
  std::vector<std::string> waiting = {main};
  const std::string view = fs::path(main).replace_extension(".view.json").generic_string();
  if (fs::is_regular_file(root / view, error)) waiting.push_back(view);
  while (!waiting.empty()) {
    const std::string name = waiting.back();
    waiting.pop_back();
    if (files.count(name)) continue;
    const std::string& text = files[name] = read_file(root / name);
    for (const std::string& quoted : quoted_texts(text)) {
      for (const fs::path& base : {fs::path(name).parent_path(), fs::path()}) {
        const std::string found = name_in_bundle(root, base, quoted);
        if (!found.empty()) waiting.push_back(found);
      }
    }
  }
  return files;
}

}  // namespace mbcosim::client
