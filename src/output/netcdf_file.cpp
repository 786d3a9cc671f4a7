#include "output/netcdf_file.h"

#include "output/netcdf_library.h"

namespace mbcosim {

namespace {

const NetcdfLibrary& nc() { return NetcdfLibrary::get(); }

}  // namespace

void NetcdfFile::check(int code) {
  if (code != NC_NOERR && problem_.empty()) problem_ = nc().strerror(code);
}

NetcdfFile::~NetcdfFile() {
  if (id_ >= 0) nc().close(id_);
}

void NetcdfFile::create(const std::string& path) {
  path_ = path;
  problem_ = nc().problem;
  if (!problem_.empty()) return;
  check(nc().create(path.c_str(), NC_CLOBBER | NC_64BIT_OFFSET, &id_));
  defining_ = problem_.empty();
}

void NetcdfFile::define() {
  if (defining_ || !problem_.empty()) return;
  check(nc().redef(id_));
  defining_ = true;
}

void NetcdfFile::write() {
  if (!defining_ || !problem_.empty()) return;
  check(nc().enddef(id_));
  defining_ = false;
}

int NetcdfFile::dimension(const std::string& name, std::size_t length) {
  define();
  int id = -1;
  if (problem_.empty())
    check(nc().def_dim(id_, name.c_str(), length == kUnlimited ? NC_UNLIMITED : length, &id));
  return id;
}

int NetcdfFile::variable(const std::string& name, Type type, const std::vector<int>& dimensions) {
  define();
  int id = -1;
  if (problem_.empty())
    check(nc().def_var(id_, name.c_str(), type == Type::integer ? NC_INT : NC_DOUBLE,
                       static_cast<int>(dimensions.size()), dimensions.data(), &id));
  return id;
}

void NetcdfFile::attribute(int variable, const char* name, const std::string& text) {
  if (text.empty()) return;
  define();
  if (problem_.empty())
    check(nc().put_att_text(id_, variable < 0 ? NC_GLOBAL : variable, name, text.size(),
                            text.c_str()));
}

void NetcdfFile::put(int variable, const std::vector<int>& data) {
  write();
  if (problem_.empty() && !data.empty()) check(nc().put_var_int(id_, variable, data.data()));
}

void NetcdfFile::put(int variable, const std::vector<double>& data) {
  write();
  if (problem_.empty() && !data.empty()) check(nc().put_var_double(id_, variable, data.data()));
}

void NetcdfFile::put_record(int variable, std::size_t record, const std::vector<std::size_t>& shape,
                            const double* data) {
  write();
  if (!problem_.empty()) return;
  std::size_t start[4] = {record, 0, 0, 0}, count[4] = {1, 1, 1, 1};
  for (std::size_t k = 0; k < shape.size(); ++k) count[k + 1] = shape[k];
  check(nc().put_vara_double(id_, variable, start, count, data));
}

void NetcdfFile::put_record(int variable, std::size_t record, int value) {
  write();
  if (problem_.empty()) check(nc().put_var1_int(id_, variable, &record, &value));
}

Status NetcdfFile::finish() {
  write();
  if (id_ >= 0) {
    check(nc().close(id_));
    id_ = -1;
  }
  if (problem_.empty()) return ok();
  return make_error(ErrorKind::io, "OUTPUT_NOT_WRITTEN", "cannot write " + path_ + ": " + problem_);
}

}  // namespace mbcosim
