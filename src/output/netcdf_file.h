/// A NetCDF file being written; hides the C library. The first failure is kept, later calls do
/// nothing. With a budget, records that could not be written wait for the next `flush`, which tries
/// again. Files of several threads may be written at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "model/diagnostic.h"
#include "output/result_budget.h"

namespace mbcosim {

class NetcdfFile {
 public:
  static constexpr std::size_t kUnlimited = 0;
  enum class Type { integer, real };

  NetcdfFile() = default;
  ~NetcdfFile();
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  /// `budget`: of which the file's bytes are taken, headers about; null: without bound.
  void create(const std::string& path, ResultBudget* budget = nullptr);
  /// Goes on with a file that another NetcdfFile wrote: what it has of the definitions that follow
  /// is found by name.
  void reopen(const std::string& path, ResultBudget* budget);
  /// Ends the file after so many records, when `bytes` of the budget had been taken, and goes on
  /// there. Forgets what went wrong.
  void cut(std::size_t records, std::int64_t bytes);
  std::int64_t bytes() const { return bytes_; }  ///< taken of the budget

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

  /// All so far is in the file, unless `status` tells why not.
  Status flush(bool to_disk);
  Status finish();
  Status status() const;

 private:
  void open();
  void close();
  /// A file without its whole header cannot be read.
  void remove_rest();
  void define();
  void write();
  void check(int code);
  bool take(std::size_t bytes);
  bool charge(std::size_t bytes);
  using Put = std::function<int(int id)>;  ///< a code of the library
  template <class How>
  void put_in_record(std::size_t record, std::size_t bytes, How put);
  void check_record(int code);
  void settle();
  void forget_waiting();
  void retry();
  bool works() const { return problem_.empty() && damage_ && !over_budget_; }

  std::string path_, problem_;
  static constexpr std::int64_t kWhole = std::numeric_limits<std::int64_t>::max();
  /// Bytes of a file that was there before; the library fills with zeros, when it closes a file,
  /// what its header speaks of and is not there.
  std::int64_t found_ = kWhole;
  Status damage_ = ok();  ///< what is there is not what was written before
  ResultBudget* budget_ = nullptr;
  std::int64_t bytes_ = 0;
  int id_ = -1;
  bool defining_ = false;
  bool created_ = false, whole_ = false;  ///< `whole_`: its first header is in the file
  bool looks_up_ = false;                 ///< the file may have definitions already
  bool over_budget_ = false;
  static constexpr std::size_t kMostWaiting = 4 << 20;  ///< bytes, before they are settled
  std::vector<Put> waiting_;                            ///< since the last record that is settled
  std::size_t waiting_bytes_ = 0;
  std::size_t records_ = 0, settled_ = 0;  ///< so far; those that are whole in the file
  bool may_retry_ = false;                 ///< the problem is of records
};

}  // namespace mbcosim
