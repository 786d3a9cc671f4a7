#include "results/session_results.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

const std::string kPrefix = "results";
const std::string kIndex = "steps.index";

std::vector<ResultFormat> formats_of(const v1::ResultOptions& options) {
  std::vector<ResultFormat> formats;
  for (const int format : options.formats()) {
    if (format != v1::RESULT_FORMAT_TEXT && format != v1::RESULT_FORMAT_NETCDF)
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`results.formats` has a value that is unknown to this server");
    formats.push_back(format == v1::RESULT_FORMAT_TEXT ? ResultFormat::text : ResultFormat::netcdf);
  }
  return formats;
}

std::int64_t quota_of(const v1::ResultOptions& options, std::int64_t most) {
  if (!options.has_quota_bytes()) return most;
  if (options.quota_bytes() <= 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`results.quota_bytes` must be positive, got " +
                                               std::to_string(options.quota_bytes()));
  if (options.quota_bytes() > most)
    throw limit_refusal("results_bytes", most, "the quota is larger than allowed");
  return options.quota_bytes();
}

}  // namespace

SessionResults::SessionResults(ResultsRoot& root, const std::string& simulation,
                               const v1::ResultOptions& options, std::int64_t most)
    : formats_(formats_of(options)), folder_(root.make(simulation, quota_of(options, most))) {}

SessionResults::SessionResults(ResultsRoot& root, const std::string& simulation,
                               const v1::ResultOptions& options, std::int64_t most, bool* found)
    : formats_(formats_of(options)),
      folder_(root.reopen(simulation, quota_of(options, most), found)) {
  folder_->keep(*found);
}

void SessionResults::sync() const {
  std::error_code error;
  for (fs::directory_iterator entry(folder_->path(), error), end; !error && entry != end;
       entry.increment(error)) {
    const int file = ::open(entry->path().c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) continue;
    (void)::fsync(file);
    ::close(file);
  }
}

SessionResults::~SessionResults() {
  if (writer_) (void)writer_->finish();
  if (discarded_.load()) folder_->keep(false);
}

std::shared_ptr<ResultHistory> SessionResults::start(const Model& model) {
  auto files = make_result_writer(formats_.empty() ? result_formats(model) : formats_,
                                  path(kPrefix), &folder_->budget());
  writer_ = std::make_shared<ResultHistory>(std::move(files), path(kIndex), folder_->budget());
  return writer_;
}

Status SessionResults::ready() {
  if (auto status = writer_->status(); !status) {
    if (auto again = writer_->flush(false); !again) return without_paths(again.error());
  }
  if (writer_->has_room()) return ok();
  Error full;
  full.kind = ErrorKind::limit;
  full.reason = "results_bytes";
  full.message = "there is no room for the results of another step: the files may take " +
                 std::to_string(folder_->budget().most()) + " bytes";
  return full;
}

Error SessionResults::without_paths(Error error) const {
  const std::string folder = folder_->path() + "/";
  for (auto at = error.message.find(folder); at != std::string::npos;
       at = error.message.find(folder, at))
    error.message.erase(at, folder.size());
  return error;
}

void SessionResults::expect(std::int64_t step) { writer_->expect(step); }

void SessionResults::check_way_back(std::int64_t step) const {
  if (const Status possible = writer_->can_go_back(step); !possible)
    throw Refusal(without_paths(possible.error()));
}

// ------------------------------------------------------------------ reading

void SessionResults::flush() {
  const Status written = writer_->flush(false);
  if (!written && written.error().kind != ErrorKind::limit)  // what is there can be read
    throw Refusal(without_paths(written.error()));
}

std::vector<std::string> SessionResults::names() const {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder_->path(), error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().filename() != kIndex) names.push_back(entry->path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

void SessionResults::list(v1::ListResultsReply* out) {
  flush();
  for (const std::string& name : names()) {
    std::error_code none;
    v1::ResultFile* file = out->add_files();
    file->set_name(name);
    const auto size = fs::file_size(path(name), none);
    if (!none) file->set_size_bytes(static_cast<std::int64_t>(size));
  }
  out->set_step(writer_->end());
  out->set_used_bytes(folder_->budget().used());
  out->set_quota_bytes(folder_->budget().most());
}

std::int64_t SessionResults::size_of(const std::string& file, std::int64_t* cuts) {
  flush();
  const std::vector<std::string> known = names();
  std::error_code error;
  if (std::find(known.begin(), known.end(), file) != known.end()) {
    const auto size = fs::file_size(path(file), error);
    *cuts = cuts_.load();
    if (!error) return static_cast<std::int64_t>(size);
  }
  throw Refusal(v1::REASON_NO_SUCH_FILE,
                "the simulation has no result file named \"" + file.substr(0, 100) + "\"");
}

std::string SessionResults::read(const std::string& file, std::int64_t from, std::size_t most,
                                 std::int64_t cuts) const {
  std::string bytes(most, '\0');
  const int fd = ::open(path(file).c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
  const ssize_t count = fd < 0 ? -1 : ::pread(fd, bytes.data(), most, from);
  if (fd >= 0) ::close(fd);
  if (count <= 0 || cuts_.load() != cuts)
    throw Refusal(v1::REASON_RESULTS_CHANGED,
                  "the files were cut while they were read: the simulation was restored");
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

}  // namespace mbcosim::server
