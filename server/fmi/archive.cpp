#include "fmi/archive.h"

#include <zip.h>

namespace mbcosim::fmi {
namespace {

Error io_error(const std::string& path, const char* reason) {
  return make_error(ErrorKind::io, "", "cannot write \"" + path + "\": " + reason);
}

bool add(zip_t* archive, const std::string& name, const std::string& content) {
  constexpr zip_uint16_t kDate = 0x21, kTime = 0;  // 1 January 1980, the first day that zip knows
  zip_source_t* source = zip_source_buffer(archive, content.data(), content.size(), 0);
  if (!source) return false;
  const zip_int64_t index = zip_file_add(archive, name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (index < 0) {
    zip_source_free(source);
    return false;
  }
  const auto entry = static_cast<zip_uint64_t>(index);
  return zip_file_set_dostime(archive, entry, kTime, kDate, 0) == 0 &&
         zip_set_file_compression(archive, entry, ZIP_CM_DEFLATE, 0) == 0;
}

}  // namespace

mbcosim::Status write_archive(const std::string& path,
                              const std::map<std::string, std::string>& files) {
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  if (!archive) {
    zip_error_t reason;
    zip_error_init_with_code(&reason, code);
    Error error = io_error(path, zip_error_strerror(&reason));
    zip_error_fini(&reason);
    return error;
  }
  bool good = true;
  for (const auto& [name, content] : files) good = good && add(archive, name, content);
  if (good && zip_close(archive) == 0) return ok();
  Error error = io_error(path, zip_strerror(archive));
  zip_discard(archive);
  return error;
}

}  // namespace mbcosim::fmi
