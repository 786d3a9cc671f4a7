#include "durable/journal.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "durable/state_folder.h"

namespace mbcosim::server::journal_test {
namespace {

namespace fs = std::filesystem;

class JournalTest : public ::testing::Test {
 protected:
  JournalTest() : root_(make_root()), folder_(root_, 1 << 20) { folder_.write_model("id", {}); }
  ~JournalTest() override { fs::remove_all(root_); }

  std::vector<std::string> messages() {
    std::vector<std::string> found;
    folder_.read_journals("id", [&](StoredEntry entry) {
      EXPECT_EQ(entry.state, state_of(entry.message));
      found.push_back(std::move(entry.message));
    });
    return found;
  }
  static std::string state_of(const std::string& message) {
    return "state of " + message + std::string(100, '\0');
  }
  void append(Journal& journal, const std::string& message) {
    journal.append(message, state_of(message));
  }
  std::string bytes(int file) const {
    std::ifstream in(folder_.journal_path("id", file), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Limits the size of files while it lives, as a full disk would: writes stop halfway.
  struct FullDisk {
    explicit FullDisk(rlim_t most) {
      ::getrlimit(RLIMIT_FSIZE, &before);
      rlimit now = before;
      now.rlim_cur = most;
      ::setrlimit(RLIMIT_FSIZE, &now);
      handler = std::signal(SIGXFSZ, SIG_IGN);
    }
    ~FullDisk() {
      ::setrlimit(RLIMIT_FSIZE, &before);
      std::signal(SIGXFSZ, handler);
    }
    rlimit before{};
    void (*handler)(int);
  };

  const std::string root_;
  StateFolder folder_;

 private:
  static std::string make_root() {
    std::string name = (fs::temp_directory_path() / "mbcosim-XXXXXX").string();
    return ::mkdtemp(name.data());
  }
};

using Messages = std::vector<std::string>;

TEST_F(JournalTest, EntriesComeBackInTheirOrder) {
  {
    Journal journal(folder_, "id");
    append(journal, "1");
    append(journal, "2");
    journal.rotate();
    append(journal, "3");
  }
  Journal next(folder_, "id");
  append(next, "4");
  EXPECT_EQ(messages(), (Messages{"1", "2", "3", "4"}));
  EXPECT_EQ(folder_.journals("id"), (std::vector<int>{1, 2, 3}));
}

TEST_F(JournalTest, FilesBeforeACheckpointGoAndTheirBytesAreFree) {
  const std::int64_t before = folder_.used();
  Journal journal(folder_, "id");
  append(journal, "1");
  journal.rotate();
  const int end = journal.next();
  append(journal, "2");
  folder_.remove_journals("id", end);
  EXPECT_EQ(messages(), Messages{"2"});
  EXPECT_EQ(folder_.used(), before + static_cast<std::int64_t>(bytes(2).size()));
}

TEST_F(JournalTest, WhatWasBeingWrittenIsLeftOutWhereverItEnds) {
  Journal journal(folder_, "id");
  append(journal, "1");
  const std::string one = bytes(1);
  append(journal, "2");
  const std::string both = bytes(1);
  const std::int64_t used = folder_.used();
  for (std::size_t end = one.size(); end < both.size(); ++end) {
    std::ofstream(folder_.journal_path("id", 1), std::ios::binary) << both.substr(0, end);
    EXPECT_EQ(messages(), Messages{"1"}) << "byte " << end;
    EXPECT_EQ(bytes(1).size(), end) << "who reads changes nothing";
  }
  EXPECT_EQ(folder_.used(), used);
  Journal next(folder_, "id");
  append(next, "3");
  EXPECT_EQ(messages(), (Messages{"1", "3"})) << "in a file of its own";
}

TEST_F(JournalTest, EveryFlippedBitIsFoundAndNamed) {
  Journal journal(folder_, "id");
  append(journal, "1");
  append(journal, "2");
  const std::string good = bytes(1);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string damaged = good;
    damaged[at] ^= static_cast<char>(1 << (at % 8));
    std::ofstream(folder_.journal_path("id", 1), std::ios::binary) << damaged;
    try {
      messages();
      ADD_FAILURE() << "byte " << at;
    } catch (const DamagedFile& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, 20), "id/journal-1: record") << error.what();
    }
  }
}

TEST_F(JournalTest, WhatCannotBeWrittenLeavesNothingAndGoesOnLater) {
  Journal journal(folder_, "id");
  append(journal, "1");
  const std::string one = bytes(1);
  {
    const FullDisk full(one.size() + 20);
    EXPECT_THROW(append(journal, "2"), StorageError);
    EXPECT_EQ(bytes(1), one);
  }
  append(journal, "3");
  EXPECT_EQ(messages(), (Messages{"1", "3"}));
}

TEST_F(JournalTest, TheFirstEntryOfAFileMayFailToo) {
  Journal journal(folder_, "id");
  for (const rlim_t most : {0, 10, 40}) {
    const FullDisk full(most);
    EXPECT_THROW(append(journal, "1"), StorageError);
  }
  EXPECT_EQ(messages(), Messages{});
  append(journal, "2");
  EXPECT_EQ(messages(), Messages{"2"});
}

TEST_F(JournalTest, TheLimitOfTheFolderHolds) {
  Journal journal(folder_, "id");
  EXPECT_THROW(journal.append("large", std::string(2 << 20, 'x')), StorageError);
  append(journal, "1");
  EXPECT_EQ(messages(), Messages{"1"});
}

TEST_F(JournalTest, DeletionsComeBackInTheirOrderAndCountNothing) {
  const std::int64_t before = folder_.used();
  EXPECT_TRUE(folder_.read_removals().empty());
  folder_.write_removals({{"given", "up", "simulations/0"}});
  folder_.write_removals({{"an identity", "a", "simulations/1"}, {"", std::string(128, '\0'), ""}});
  const std::deque<StoredRemoval> found = folder_.read_removals();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].identity, "an identity");
  EXPECT_EQ(found[0].request_id, "a");
  EXPECT_EQ(found[0].simulation, "simulations/1");
  EXPECT_EQ(found[1].request_id, std::string(128, '\0'));
  EXPECT_EQ(folder_.used(), before);
}

}  // namespace
}  // namespace mbcosim::server::journal_test
