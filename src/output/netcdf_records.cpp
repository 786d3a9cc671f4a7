// Source: "The NetCDF Classic Format Specification", Unidata, appendix B of the NetCDF user's
// guide.
#include "output/netcdf_records.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>

namespace mbcosim {

namespace {

struct Broken : std::runtime_error {
  Broken() : std::runtime_error("the header cannot be read") {}
};

/// Reads what the header is made of: numbers with the first byte first.
class Header {
 public:
  explicit Header(std::FILE* file) : file_(file) {}
  std::int64_t number(int bytes) {
    std::int64_t value = 0;
    for (int k = 0; k < bytes; ++k) {
      const int byte = std::fgetc(file_);
      if (byte == EOF) throw Broken();
      value = value * 256 + byte;
    }
    return value;
  }
  std::int64_t length() { return number(4); }
  void skip(std::int64_t bytes) {
    if (bytes < 0 || std::fseek(file_, (bytes + 3) / 4 * 4, SEEK_CUR) != 0) throw Broken();
  }
  void skip_name() { skip(length()); }
  /// Calls `read` for each entry of a list.
  template <class Read>
  void list(Read&& read) {
    skip(4);  // what it lists
    for (std::int64_t left = length(); left > 0; --left) read();
  }
  void skip_attributes() {
    list([this] {
      constexpr int kSizes[] = {0, 1, 1, 2, 4, 4, 8};  // byte, char, short, int, float, double
      skip_name();
      const std::int64_t type = length();
      if (type < 1 || type > 6) throw Broken();
      skip(length() * kSizes[type]);
    });
  }

 private:
  std::FILE* file_;
};

struct Records {
  std::int64_t count = 0;
  std::int64_t begin = std::numeric_limits<std::int64_t>::max();  ///< first byte of the first one
  std::int64_t size = 0;                                          ///< of one [bytes]
};

Records read_records(std::FILE* file) {
  Header header(file);
  Records records;
  constexpr std::int64_t kMagic = 0x43444602;  // "CDF", 64-bit offsets
  if (header.number(4) != kMagic) throw Broken();
  records.count = header.length();
  std::int64_t dimension = 0, unlimited = -1;
  header.list([&] {
    header.skip_name();
    if (header.length() == 0) unlimited = dimension;
    ++dimension;
  });
  header.skip_attributes();
  header.list([&] {
    header.skip_name();
    const std::int64_t dimensions = header.length();
    const bool in_record = dimensions > 0 && header.length() == unlimited;
    header.skip(4 * std::max<std::int64_t>(0, dimensions - 1));
    header.skip_attributes();
    header.skip(4);  // type
    const std::int64_t size = header.length(), begin = header.number(8);
    if (!in_record) return;
    records.size += size;
    records.begin = std::min(records.begin, begin);
  });
  if (records.size <= 0) throw Broken();
  return records;
}

void write_count(std::FILE* file, std::int64_t count) {
  unsigned char bytes[4];
  for (int k = 0; k < 4; ++k) bytes[k] = static_cast<unsigned char>(count >> (24 - 8 * k));
  if (std::fseek(file, 4, SEEK_SET) != 0 || std::fwrite(bytes, 1, 4, file) != 4 ||
      std::fflush(file) != 0)
    throw Broken();
}

void cut(std::FILE* file, std::int64_t count, std::int64_t size) {
  const Records records = read_records(file);
  const std::int64_t end = records.begin + count * records.size;
  if (count > records.count || (count > 0 && end > size))
    throw std::runtime_error("the file ends before that step");
  write_count(file, count);
  if (ftruncate(fileno(file), end) != 0) throw std::runtime_error("it cannot be made shorter");
}

}  // namespace

Status cut_records(const std::string& path, std::int64_t count, std::int64_t size) try {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "r+b"),
                                                             &std::fclose);
  if (!file) throw std::runtime_error("it cannot be opened");
  cut(file.get(), count, size);
  return ok();
} catch (const std::runtime_error& problem) {
  return make_error(ErrorKind::data_loss, "RESULTS_CUT_SHORT",
                    "cannot go on with \"" + path + "\": " + problem.what());
}

}  // namespace mbcosim
