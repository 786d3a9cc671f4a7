#include "output/netcdf_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <mutex>

#include "output/netcdf_library.h"
#include "output/netcdf_records.h"

namespace mbcosim {

namespace {

const NetcdfLibrary& nc() { return NetcdfLibrary::get(); }

/// The library keeps a list of open files that it does not protect.
std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

template <class Function, class... Arguments>
int locked(Function function, Arguments... arguments) {
  const std::lock_guard lock(library_mutex());
  return function(arguments...);
}

}  // namespace

void NetcdfFile::check(int code) {
  if (code != NC_NOERR && problem_.empty()) problem_ = nc().strerror(code);
}

bool NetcdfFile::take(std::size_t bytes) { return works() && charge(bytes); }

bool NetcdfFile::charge(std::size_t bytes) {
  const auto count = static_cast<std::int64_t>(bytes);
  if (budget_ && !budget_->take(count)) over_budget_ = true;
  if (!over_budget_) bytes_ += count;
  return !over_budget_;
}

NetcdfFile::~NetcdfFile() {
  close();
  remove_rest();
}

void NetcdfFile::remove_rest() {
  namespace fs = std::filesystem;
  std::error_code none;
  if (created_ && !whole_ && !problem_.empty() &&
      fs::is_regular_file(fs::symlink_status(path_, none)))
    fs::remove(path_, none);
  created_ = false;
}

void NetcdfFile::close() {
  if (id_ >= 0) check(locked(nc().close, id_));
  id_ = -1;
  defining_ = false;
}

void NetcdfFile::create(const std::string& path, ResultBudget* budget) {
  path_ = path;
  budget_ = budget;
  problem_ = nc().problem;
  if (!works()) return;
  check(locked(nc().create, path.c_str(), NC_CLOBBER | NC_64BIT_OFFSET, &id_));
  created_ = defining_ = problem_.empty();
}

void NetcdfFile::open() {
  looks_up_ = true;
  if (works()) check(locked(nc().open, path_.c_str(), NC_WRITE, &id_));
}

void NetcdfFile::reopen(const std::string& path, ResultBudget* budget) {
  path_ = path;
  budget_ = budget;
  problem_ = nc().problem;
  std::error_code none;
  found_ = static_cast<std::int64_t>(std::filesystem::file_size(path_, none));  // -1: none
  open();
}

void NetcdfFile::cut(std::size_t records, std::int64_t bytes) {
  write();
  close();
  over_budget_ = false;
  problem_ = nc().problem;
  if (budget_) budget_->give_back(bytes_);
  bytes_ = 0;
  damage_ = cut_records(path_, static_cast<std::int64_t>(records), found_);
  found_ = kWhole;
  records_ = records;
  forget_waiting();
  if (damage_) open();
  (void)take(static_cast<std::size_t>(bytes));
}

void NetcdfFile::define() {
  if (defining_ || !works()) return;
  check(locked(nc().redef, id_));
  defining_ = true;
}

void NetcdfFile::write() {
  if (!defining_ || !works()) return;
  check(locked(nc().enddef, id_));
  defining_ = false;
  if (!created_ || whole_ || !works()) return;
  check(locked(nc().sync, id_));
  whole_ = problem_.empty();
}

int NetcdfFile::dimension(const std::string& name, std::size_t length) {
  int id = -1;
  if (looks_up_ && works() && locked(nc().inq_dimid, id_, name.c_str(), &id) == NC_NOERR) return id;
  define();
  if (works())
    check(
        locked(nc().def_dim, id_, name.c_str(), length == kUnlimited ? NC_UNLIMITED : length, &id));
  return id;
}

int NetcdfFile::variable(const std::string& name, Type type, const std::vector<int>& dimensions) {
  constexpr std::size_t kHeader = 200;  // about, of a variable with its attributes
  int id = -1;
  if (looks_up_ && works() && locked(nc().inq_varid, id_, name.c_str(), &id) == NC_NOERR) return id;
  define();
  if (take(kHeader + name.size()))
    check(locked(nc().def_var, id_, name.c_str(), type == Type::integer ? NC_INT : NC_DOUBLE,
                 static_cast<int>(dimensions.size()), dimensions.data(), &id));
  return id;
}

void NetcdfFile::attribute(int variable, const char* name, const std::string& text) {
  if (text.empty()) return;
  define();
  if (works())
    check(locked(nc().put_att_text, id_, variable < 0 ? NC_GLOBAL : variable, name, text.size(),
                 text.c_str()));
}

void NetcdfFile::put(int variable, const std::vector<int>& data) {
  write();
  if (!data.empty() && take(sizeof(int) * data.size()))
    check(locked(nc().put_var_int, id_, variable, data.data()));
}

void NetcdfFile::put(int variable, const std::vector<double>& data) {
  write();
  if (!data.empty() && take(sizeof(double) * data.size()))
    check(locked(nc().put_var_double, id_, variable, data.data()));
}

void NetcdfFile::put_record(int variable, std::size_t record, const std::vector<std::size_t>& shape,
                            const double* data) {
  write();
  std::size_t start[4] = {record, 0, 0, 0}, count[4] = {1, 1, 1, 1}, values = 1;
  for (std::size_t k = 0; k < shape.size(); ++k) values *= count[k + 1] = shape[k];
  put_in_record(record, sizeof(double) * values, [&](bool keep) -> Put {
    if (keep)
      return [=, kept = std::vector<double>(data, data + values)](int id) {
        return locked(nc().put_vara_double, id, variable, start, count, kept.data());
      };
    check_record(locked(nc().put_vara_double, id_, variable, start, count, data));
    return {};
  });
}

void NetcdfFile::put_record(int variable, std::size_t record, int value) {
  write();
  put_in_record(record, sizeof value, [&](bool keep) -> Put {
    if (keep)
      return [=](int id) { return locked(nc().put_var1_int, id, variable, &record, &value); };
    check_record(locked(nc().put_var1_int, id_, variable, &record, &value));
    return {};
  });
}

/// `put(true)` tells how it can be done once more, `put(false)` does it.
template <class How>
void NetcdfFile::put_in_record(std::size_t record, std::size_t bytes, How put) {
  if (over_budget_ || (!problem_.empty() && !may_retry_)) return;
  if (!charge(bytes)) return;
  records_ = record + 1;
  if (budget_) {
    waiting_.push_back(put(true));
    waiting_bytes_ += bytes;
  }
  if (!problem_.empty()) return;
  put(false);
  if (waiting_bytes_ > kMostWaiting) settle();
}

/// What fails here can be done once more, when there is room on the disk.
void NetcdfFile::check_record(int code) {
  check(code);
  if (code != NC_NOERR) may_retry_ = budget_ != nullptr;
}

void NetcdfFile::settle() {
  if (works()) check_record(locked(nc().sync, id_));
  if (works()) forget_waiting();
}

void NetcdfFile::forget_waiting() {
  waiting_.clear();
  waiting_bytes_ = 0;
  settled_ = records_;
  may_retry_ = false;
}

/// From the last record that is whole.
void NetcdfFile::retry() {
  close();
  problem_.clear();
  damage_ = cut_records(path_, static_cast<std::int64_t>(settled_), kWhole);
  if (damage_) open();
  for (const Put& put : waiting_)
    if (works()) check_record(put(id_));
}

Status NetcdfFile::flush(bool to_disk) {
  if (!problem_.empty() && may_retry_ && !over_budget_) retry();
  write();
  settle();
  if (!to_disk || !works()) return status();
  const int file = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0 || fsync(file) != 0) {
    problem_ = std::strerror(errno);
    may_retry_ = budget_ != nullptr;
  }
  if (file >= 0) ::close(file);
  return status();
}

Status NetcdfFile::finish() {
  write();
  close();
  remove_rest();
  return status();
}

Status NetcdfFile::status() const {
  if (over_budget_) return over_budget(*budget_);
  if (!damage_) return damage_;
  if (problem_.empty()) return ok();
  return make_error(ErrorKind::io, "OUTPUT_NOT_WRITTEN", "cannot write " + path_ + ": " + problem_);
}

}  // namespace mbcosim
