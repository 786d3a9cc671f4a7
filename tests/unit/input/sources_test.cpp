#include "input/sources.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

namespace mbcosim::sources_test {
namespace {

namespace fs = std::filesystem;

/// A folder `inside` with a file and links, and a file `secret` beside it.
class FolderSourceTest : public testing::Test {
 protected:
  FolderSourceTest() {
    std::string name = (fs::temp_directory_path() / "mbcosim-sources-XXXXXX").string();
    root_ = mkdtemp(name.data());
    fs::create_directories(root_ / "inside/sub");
    std::ofstream(root_ / "secret") << "secret";
    std::ofstream(root_ / "inside/a.mbd") << "text";
    fs::create_symlink(root_ / "secret", root_ / "inside/link");
    fs::create_symlink("a.mbd", root_ / "inside/good");
    fs::create_symlink(root_, root_ / "inside/up");
  }
  ~FolderSourceTest() override { fs::remove_all(root_); }

  std::string read(const std::string& name, bool unrestricted = false) const {
    const Result<std::string> r =
        FolderSource((root_ / "inside").string(), unrestricted).read(name);
    return r ? *r : "error: " + r.error().message;
  }

  fs::path root_;
};

TEST_F(FolderSourceTest, ReadsFilesBelowTheFolder) {
  EXPECT_EQ(read("a.mbd"), "text");
  EXPECT_EQ(read("sub/../a.mbd"), "text");
  EXPECT_EQ(read("good"), "text");
}

TEST_F(FolderSourceTest, RefusesWhatLiesOutside) {
  EXPECT_EQ(read("../secret"), "error: \"../secret\" is outside the allowed folder");
  EXPECT_EQ(read((root_ / "secret").string()),
            "error: \"" + (root_ / "secret").string() + "\" is outside the allowed folder");
  EXPECT_EQ(read("link"), "error: \"link\" is outside the allowed folder");
  EXPECT_EQ(read("up/secret"), "error: \"up/secret\" is outside the allowed folder");
  EXPECT_EQ(read("sub/../../secret"), "error: \"sub/../../secret\" is outside the allowed folder");
}

TEST_F(FolderSourceTest, RefusesWhatIsNoFile) {
  EXPECT_EQ(read("sub"), "error: \"sub\" is not a regular file");
  EXPECT_EQ(read("missing"), "error: cannot open \"missing\"");
  EXPECT_EQ(read(""), "error: cannot open \"\"");
}

TEST_F(FolderSourceTest, UnrestrictedReadsTheUsersOwnFiles) {
  EXPECT_EQ(read("../secret", true), "secret");
  EXPECT_EQ(read((root_ / "secret").string(), true), "secret");
}

TEST_F(FolderSourceTest, UnrestrictedTellsTheReason) {
  EXPECT_EQ(read("missing", true), "error: cannot open \"missing\": No such file or directory");
}

TEST_F(FolderSourceTest, UnrestrictedReadsPipesToTheirEnd) {
  const std::string pipe = (root_ / "inside/pipe").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(read("pipe"), "error: \"pipe\" is not a regular file");
  const std::string long_text(200'000, 'x');
  std::thread writer([&] { std::ofstream(pipe) << long_text << "end"; });
  EXPECT_EQ(read("pipe", true), long_text + "end");
  writer.join();
}

TEST_F(FolderSourceTest, UnrestrictedRefusesAStreamWithoutEnd) {
  EXPECT_EQ(read("/dev/zero", true), "error: \"/dev/zero\" does not end: 256 MiB were read");
}

TEST_F(FolderSourceTest, OneFileIsKnownByAllItsNames) {
  const std::string a = (root_ / "inside/a.mbd").string(), link = (root_ / "inside/good").string();
  EXPECT_EQ(file_in_both({(root_ / "secret").string(), a}, {link}), a);
  EXPECT_EQ(file_in_both({a}, {(root_ / "none").string(), (root_ / "secret").string()}), "");
  EXPECT_EQ(file_in_both({(root_ / "none").string()}, {(root_ / "none").string()}), "");
}

TEST(BundleSource, KnowsItsFilesOnly) {
  const BundleSource bundle(std::map<std::string, std::string>{{"a/b", "text"}});
  EXPECT_EQ(*bundle.read("a/b"), "text");
  EXPECT_EQ(bundle.read("b").error().message, "cannot open \"b\"");
  EXPECT_EQ(bundle.read("../b").error().message, "\"../b\" is outside the allowed folder");
}

}  // namespace
}  // namespace mbcosim::sources_test
