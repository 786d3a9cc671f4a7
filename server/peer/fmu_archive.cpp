#include "peer/fmu_archive.h"

#include <zip.h>

#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <pugixml.hpp>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace mbcosim::peer {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
constexpr zip_int64_t kMostEntries = 100000;
constexpr std::size_t kMostNumbers = 1000000;  ///< of an array

using Archive = std::unique_ptr<zip_t, decltype(&zip_discard)>;
using Entry = std::unique_ptr<zip_file_t, decltype(&zip_fclose)>;

[[noreturn]] void refuse(const std::string& what) { throw std::runtime_error(what); }

bool leads_out(const fs::path& name) {
  if (name.is_absolute()) return true;
  for (const fs::path& part : name)
    if (part == "..") return true;
  return false;
}

/// Copies at most `room` bytes; returns how many.
std::uint64_t copy(zip_file_t* from, std::ofstream& to, std::uint64_t room) {
  std::vector<char> buffer(1 << 16);
  std::uint64_t done = 0;
  for (;;) {
    const zip_int64_t n = zip_fread(from, buffer.data(), buffer.size());
    if (n < 0) refuse("it is damaged");
    if (n == 0) return done;
    done += static_cast<std::uint64_t>(n);
    if (done > room) refuse("it would unpack to more than a gigabyte");
    to.write(buffer.data(), n);
    if (!to) refuse("no room to unpack it");
  }
}

/// FMI 2 has the type in a child, FMI 3 texts in children.
std::optional<std::string> start_of(const pugi::xml_node& variable, bool fmi3) {
  if (fmi3 && variable.child("Start")) return variable.child("Start").attribute("value").value();
  const pugi::xml_attribute start = (fmi3 ? variable : variable.first_child()).attribute("start");
  return start ? std::optional<std::string>(start.value()) : std::nullopt;
}

/// Numbers of a variable of FMI 3; 0 when a structural parameter tells how many.
std::size_t size_of(const pugi::xml_node& variable) {
  std::size_t size = 1;
  for (const pugi::xml_node dimension : variable.children("Dimension")) {
    const pugi::xml_attribute start = dimension.attribute("start");
    if (!start) return 0;
    const std::string_view text = start.value();
    std::size_t count = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), count);
    if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size() ||
        count == 0 || count > kMostNumbers / size)
      refuse("the dimensions of its variable \"" + std::string(variable.attribute("name").value()) +
             "\" are not from 1 to a million");
    size *= count;
  }
  return size;
}

}  // namespace

FmuArchive::FmuArchive(const std::string& path) : name_(fs::path(path).filename().string()) {
  std::string pattern = (fs::temp_directory_path() / "mbcosim-fmu-XXXXXX").string();
  if (!::mkdtemp(pattern.data())) refuse("no folder to unpack \"" + path + "\" to");
  folder_ = pattern;
  try {
    unpack(path);
    read_description();
    require_library();
  } catch (const std::exception& e) {
    std::error_code error;
    fs::remove_all(folder_, error);
    refuse("\"" + path + "\": " + e.what());
  }
}

FmuArchive::~FmuArchive() {
  std::error_code error;
  fs::remove_all(folder_, error);
}

void FmuArchive::unpack(const std::string& path) {
  int code = 0;
  const Archive archive(zip_open(path.c_str(), ZIP_RDONLY, &code), zip_discard);
  if (!archive) refuse(fs::exists(path) ? "no zip archive" : "no such file");
  const zip_int64_t count = zip_get_num_entries(archive.get(), 0);
  if (count > kMostEntries) refuse("it has more than 100000 entries");
  std::uint64_t room = kMostBytes;
  for (zip_int64_t k = 0; k < count; ++k) {
    const auto index = static_cast<zip_uint64_t>(k);
    const char* name = zip_get_name(archive.get(), index, 0);
    if (!name || leads_out(name)) refuse("it has an entry that leads out of it");
    const fs::path target = fs::path(folder_) / name;
    if (std::string_view(name).ends_with('/')) {
      fs::create_directories(target);
      continue;
    }
    fs::create_directories(target.parent_path());
    const Entry entry(zip_fopen_index(archive.get(), index, 0), zip_fclose);
    if (!entry) refuse("it is damaged");
    std::ofstream out(target, std::ios::binary);
    room -= copy(entry.get(), out, room);
  }
}

void FmuArchive::read_description() {
  pugi::xml_document document;
  if (!document.load_file((folder_ + "/modelDescription.xml").c_str()))
    refuse("it has no modelDescription.xml that can be read");
  const pugi::xml_node root = document.child("fmiModelDescription");
  const std::string version = root.attribute("fmiVersion").value();
  fmi3_ = version.rfind("3.", 0) == 0;
  if (!fmi3_ && version != "2.0") refuse("FMI " + version + " is not served; 2.0 and 3.0 are");
  const pugi::xml_node kind = root.child("CoSimulation");
  if (!kind) refuse("it is not for co-simulation");
  identifier_ = kind.attribute("modelIdentifier").value();
  if (identifier_.empty() || identifier_.find('/') != std::string::npos)
    refuse("its modelIdentifier is none");
  token_ = root.attribute(fmi3_ ? "instantiationToken" : "guid").value();
  keeps_states_ = kind.attribute(fmi3_ ? "canGetAndSetFMUState" : "canGetAndSetFMUstate").as_bool();
  for (const pugi::xml_node node : root.child("ModelVariables")) {
    const std::string_view type = fmi3_ ? node.name() : node.first_child().name();
    if (type == "Clock" || type == "Binary") continue;  // they need no start values
    const bool real = type == (fmi3_ ? "Float64" : "Real");
    const std::string_view causality = node.attribute("causality").value();
    variables_[node.attribute("name").value()] = {node.attribute("valueReference").as_uint(),
                                                  causality == "input",
                                                  causality == "output",
                                                  real,
                                                  fmi3_ ? size_of(node) : 1,
                                                  start_of(node, fmi3_)};
  }
}

void FmuArchive::require_library() const {
  if (fs::exists(library())) return;
  std::string others;
  if (const fs::path binaries = fs::path(folder_) / "binaries"; fs::is_directory(binaries))
    for (const fs::directory_entry& platform : fs::directory_iterator(binaries))
      others +=
          (others.empty() ? "; it has folders for " : ", ") + platform.path().filename().string();
  refuse("it has no binary for this machine, " + library().substr(folder_.size() + 1) + others);
}

std::string FmuArchive::library() const {
  return folder_ + "/binaries/" + (fmi3_ ? "x86_64-linux/" : "linux64/") + identifier_ + ".so";
}

std::string FmuArchive::resources() const { return folder_ + "/resources"; }

}  // namespace mbcosim::peer
