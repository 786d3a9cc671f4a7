#include "service/attached_files.h"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <filesystem>
#include <vector>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 1024;

/// All texts in a JSON value that can be names; what the parser bounds in depth.
void collect_names(const google::protobuf::Value& value, std::vector<std::string>* out) {
  if (value.has_string_value() && !value.string_value().empty() &&
      value.string_value().size() <= kLongestName)
    out->push_back(value.string_value());
  for (const auto& item : value.list_value().values()) collect_names(item, out);
  for (const auto& [key, item] : value.struct_value().fields()) collect_names(item, out);
}

/// Files that a JSON text names, relative to `folder`; none where it is no JSON.
std::vector<std::string> named_in(const std::string& text, const fs::path& folder) {
  google::protobuf::Value value;
  std::vector<std::string> names;
  if (google::protobuf::util::JsonStringToMessage(text, &value).ok()) collect_names(value, &names);
  for (std::string& name : names) name = (folder / name).lexically_normal().generic_string();
  return names;
}

bool names_others(const std::string& path) {
  return path.ends_with(".view.json") || path.ends_with(".gltf");
}

}  // namespace

AttachedFiles read_attached(const FileSource& files, const std::string& main_file,
                            std::int64_t most_bytes) {
  AttachedFiles attached;
  std::int64_t bytes = 0;
  std::vector<std::string> waiting = {
      fs::path(main_file).replace_extension(".view.json").generic_string()};
  while (!waiting.empty()) {
    const std::string name = std::move(waiting.back());
    waiting.pop_back();
    if (attached.count(name)) continue;
    auto text = files.read(name);
    if (!text) continue;
    bytes += static_cast<std::int64_t>(text->size());
    if (bytes > most_bytes)
      throw limit_refusal("deck_bytes", most_bytes,
                          "the files that are attached to the deck are larger than allowed");
    if (names_others(name))
      for (std::string& other : named_in(*text, fs::path(name).parent_path()))
        waiting.push_back(std::move(other));
    attached.emplace(name, std::move(*text));
  }
  return attached;
}

}  // namespace mbcosim::server
