#include "cli/result_table.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace mbcosim::cli {
namespace {

constexpr const char* kNoTables[] = {"log", "m", "mbd", "nc", "out", "pmm", "png", "usr"};

Error table_error(ErrorKind kind, std::string message) {
  return make_error(kind, "", std::move(message));
}

/// "there is no X", and what to do where there is NetCDF; empty where there is not.
std::string but_netcdf(const std::string& missing, const std::string& prefix) {
  if (!std::filesystem::exists(prefix + ".nc")) return "";
  return missing + ", but \"" + prefix + ".nc\": text is read here, which `mbcosim run DECK -o " +
         prefix + "` writes without `--format netcdf`";
}

Error cannot_read(const std::string& path, const std::string& prefix) {
  if (const std::string netcdf = but_netcdf("there is no \"" + path + '"', prefix); !netcdf.empty())
    return table_error(ErrorKind::io, netcdf);
  return table_error(ErrorKind::io, "cannot read \"" + path + "\": " + std::strerror(errno) +
                                        "; `mbcosim run DECK -o " + prefix +
                                        "` writes the results of a deck");
}

/// The numbers of a line; false when one is not a number.
bool read_numbers(const std::string& line, std::vector<double>& numbers) {
  numbers.clear();
  const char* at = line.c_str();
  while (true) {
    at += std::strspn(at, " \t\r");
    if (*at == '\0') return true;
    char* end = nullptr;
    numbers.push_back(std::strtod(at, &end));
    if (end == at) return false;
    at = end;
  }
}

}  // namespace

std::vector<std::string> table_endings(const std::string& prefix) {
  namespace fs = std::filesystem;
  const fs::path path(prefix);
  const std::string start = path.filename().string() + ".";
  std::vector<std::string> found;
  std::error_code error;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const std::string ending = name.starts_with(start) ? name.substr(start.size()) : "";
    if (!ending.empty() && ending.find('.') == std::string::npos &&
        std::find(std::begin(kNoTables), std::end(kNoTables), ending) == std::end(kNoTables))
      found.push_back(ending);
  }
  std::sort(found.begin(), found.end());
  return found;
}

Error no_tables(const std::string& prefix) {
  const std::string none = "there are no results \"" + prefix + ".*\"";
  const std::string netcdf = but_netcdf(none, prefix);
  return table_error(ErrorKind::io, netcdf.empty() ? none : netcdf);
}

Result<ResultTable> read_table(const std::string& prefix, const std::string& ending) {
  ResultTable table;
  table.path = prefix + "." + ending;
  std::ifstream file(table.path);
  if (!file) return cannot_read(table.path, prefix);
  std::vector<double> numbers;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.starts_with("#")) continue;
    if (!read_numbers(line, numbers))
      return table_error(ErrorKind::argument, table.path + ":" + std::to_string(number) +
                                                  ": not a row of numbers: \"" +
                                                  line.substr(0, 40) + "\"");
    if (numbers.size() > 1)
      table.rows[static_cast<int>(numbers[0])].emplace_back(numbers.begin() + 1, numbers.end());
  }
  return table;
}

Result<std::vector<double>> read_times(const std::string& prefix) {
  const std::string path = prefix + ".out";
  std::ifstream file(path);
  if (!file) return cannot_read(path, prefix);
  std::vector<double> times;
  std::string line, word;
  while (std::getline(file, line)) {
    if (!line.starts_with("Step ")) continue;
    std::istringstream words(line);
    double time = 0;
    int written = 1;
    words >> word >> word >> time;  // step, time, length, iterations, three errors, written
    for (int k = 0; k < 5; ++k) words >> word;
    words >> written;
    if (written) times.push_back(time);
  }
  return times;
}

std::map<int, std::string> read_orientations(const std::string& prefix) {
  std::map<int, std::string> orientations;
  std::ifstream file(prefix + ".log");
  std::string line, skipped;
  while (std::getline(file, line)) {
    if (!line.starts_with("structural node: ")) continue;
    std::istringstream words(line);
    int label = 0;
    std::string kind;
    words >> skipped >> skipped >> label >> skipped >> skipped >> skipped >> kind;  // x y z
    if (words) orientations[label] = kind;
  }
  return orientations;
}

}  // namespace mbcosim::cli
