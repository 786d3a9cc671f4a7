/// A NetCDF file being written; hides the C library. The first failure is kept, later calls do
/// nothing.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/diagnostic.h"

namespace mbcosim {

class NetcdfFile {
 public:
  static constexpr std::size_t kUnlimited = 0;
  enum class Type { integer, real };

  NetcdfFile() = default;
  ~NetcdfFile();
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  void create(const std::string& path);
  /// Definitions; data mode is left and entered as needed.
  int dimension(const std::string& name, std::size_t length);
  int variable(const std::string& name, Type type, const std::vector<int>& dimensions);
  /// Text attribute; empty text: none. `variable` -1: of the file.
  void attribute(int variable, const char* name, const std::string& text);

  void put(int variable, const std::vector<int>& data);
  void put(int variable, const std::vector<double>& data);
  /// One record; `count`: values after the record dimension, shaped by `shape`.
  void put_record(int variable, std::size_t record, const std::vector<std::size_t>& shape,
                  const double* data);
  void put_record(int variable, std::size_t record, int value);

  Status finish();

 private:
  void define();
  void write();
  void check(int code);

  std::string path_, problem_;
  int id_ = -1;
  bool defining_ = false;
};

}  // namespace mbcosim
