#include "durable/record_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

namespace mbcosim::server::record_file_test {
namespace {

namespace fs = std::filesystem;

std::string two_files() {
  std::string bytes;
  RecordWriter writer([&](std::string_view piece) { bytes += piece; });
  for (const char* name : {"model", "point"}) {
    writer.begin(name);
    writer.add(RecordKind::head, "some content of " + std::string(name));
    writer.add(RecordKind::state, std::string(300, '\0'));
    writer.end();
  }
  return bytes;
}

using Found = std::vector<std::pair<RecordKind, std::string>>;

/// Reads in pieces of `piece` bytes. Throws DamagedFile.
Found read(const std::string& bytes, std::size_t piece = 1 << 20) {
  Found found;
  RecordReader reader(1 << 20, [&](RecordKind kind, std::string content) {
    found.emplace_back(kind, std::move(content));
  });
  for (std::size_t at = 0; at < bytes.size(); at += piece)
    reader.take(std::string_view(bytes).substr(at, piece));
  reader.finish();
  return found;
}

TEST(Records, ComeBackWhateverTheirPieces) {
  const std::string bytes = two_files();
  const Found whole = read(bytes);
  ASSERT_EQ(whole.size(), 8u);
  EXPECT_EQ(whole[1], std::make_pair(RecordKind::head, std::string("some content of model")));
  EXPECT_EQ(whole[6], std::make_pair(RecordKind::state, std::string(300, '\0')));
  for (const std::size_t piece : {1, 7, 16, 1000}) EXPECT_EQ(read(bytes, piece), whole);
}

TEST(Records, TellEveryFlippedBit) {
  const std::string bytes = two_files();
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] ^= static_cast<char>(1 << (at % 8));
    EXPECT_THROW(read(damaged), DamagedFile) << "byte " << at;
  }
}

TEST(Records, TellEveryCut) {
  const std::string bytes = two_files(), first = bytes.substr(0, bytes.size() / 2);
  EXPECT_EQ(read(first).size(), 4u) << "the first file is whole";
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (size == first.size()) continue;
    EXPECT_THROW(read(bytes.substr(0, size)), DamagedFile) << size;
  }
}

TEST(Records, TellWhereTheDamageIs) {
  std::string bytes = two_files();
  bytes[60] ^= 1;
  try {
    read(bytes);
    FAIL();
  } catch (const StorageError& error) {
    EXPECT_STREQ(error.what(), "record 2 at byte 31: its checksum differs");
  }
}

TEST(Records, OfAbsurdLengthAreNotWaitedFor) {
  std::string bytes = two_files();
  bytes[31 + 9] = 1;  // 2^40 bytes and more
  try {
    read(bytes);
    FAIL();
  } catch (const StorageError& error) {
    EXPECT_STREQ(error.what(), "record 2 at byte 31: its length makes no sense");
  }
}

class Atomic : public testing::Test {
 protected:
  Atomic() {
    std::string path = testing::TempDir() + "mbcosim_atomic_XXXXXX";
    folder_ = mkdtemp(path.data());
  }
  ~Atomic() override { fs::remove_all(folder_); }
  std::string text() const {
    std::ostringstream out;
    out << std::ifstream(folder_ + "/file").rdbuf();
    return out.str();
  }
  std::string folder_;
};

TEST_F(Atomic, AFileIsThereWholeOrNotAtAll) {
  {
    AtomicFile file(folder_ + "/file");
    file.write("first");
    EXPECT_FALSE(fs::exists(folder_ + "/file"));
    file.commit();
  }
  EXPECT_EQ(text(), "first");
  { AtomicFile(folder_ + "/file").write("given up"); }
  EXPECT_EQ(text(), "first");
  EXPECT_FALSE(fs::exists(folder_ + "/file.new"));
}

TEST_F(Atomic, WhatIsNoFileIsToldAndNotWaitedFor) {
  const std::string path = folder_ + "/file";
  const auto reason = [&] {
    try {
      read_pieces(path, [](std::string_view) { FAIL(); });
      return std::string();
    } catch (const StorageError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(reason(), "it cannot be opened: No such file or directory");
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(reason(), "it is no regular file");
  fs::rename(path, path + ".new");
  EXPECT_THROW(AtomicFile{path}, StorageError);  // nobody reads the pipe
  fs::create_symlink("/dev/zero", path);
  EXPECT_EQ(reason(), "it is no regular file");
  fs::remove(path);
  fs::create_directory(path);
  EXPECT_EQ(reason(), "it is no regular file");
}

TEST_F(Atomic, OnlyWhatIsStoredCanBeDamaged) {
  const std::string path = folder_ + "/file";
  const auto look = [&] { read_pieces(path, [](std::string_view) {}); };
  EXPECT_THROW(look(), DamagedFile) << "it is missing";
  fs::create_symlink(path, path);
  try {
    named("point", look);
    FAIL();
  } catch (const DamagedFile&) {
    FAIL() << "the system does not let it be read";
  } catch (const StorageError& error) {
    EXPECT_STREQ(error.what(), "point: it cannot be opened: Too many levels of symbolic links");
  }
  fs::remove(path);
  fs::create_directory(path);
  EXPECT_THROW(named("point", look), DamagedFile);
}

TEST_F(Atomic, AFullDiskIsTold) {
  fs::create_symlink("/dev/full", folder_ + "/file.new");
  try {
    AtomicFile file(folder_ + "/file");
    file.write("too much");
    FAIL();
  } catch (const StorageError& error) {
    EXPECT_STREQ(error.what(), "a file cannot be written: No space left on device");
  }
  EXPECT_FALSE(fs::exists(folder_ + "/file"));
}

}  // namespace
}  // namespace mbcosim::server::record_file_test
