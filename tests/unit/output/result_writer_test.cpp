/// What writers of results tell of their files.
#include "output/result_writer.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "deck_run.h"
#include "output/result_files.h"

namespace mbcosim::result_writer_test {
namespace {

namespace fs = std::filesystem;

const char* const kDeck = R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .05; time step: 1e-2; max iterations: 20; tolerance: 1e-9;
  derivatives tolerance: 1e-3; eigenanalysis: list, 2, 0., .02, parameter, .1, output full matrices;
end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; output results: netcdf; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, null, null;
end: nodes;
begin: elements;
  body: 2, 2, 1.5, null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 3, rod, 1, 2, 1., linear elastic, 1000.;
end: elements;
)";

class ResultFilesTest : public testing::Test {
 protected:
  ResultFilesTest()
      : folder_(fs::path(testing::TempDir()) /
                ("mbcosim_paths_" + std::to_string(reinterpret_cast<std::uintptr_t>(this)))) {
    fs::create_directories(folder_);
  }
  ~ResultFilesTest() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  const fs::path folder_;
};

TEST_F(ResultFilesTest, EveryFileOfARunIsAmongThePaths) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", std::string(kDeck)}}), "deck.mbd");
  ASSERT_TRUE(report.ok());
  const auto writer = make_result_writer(*report.model, path("x"));
  const std::vector<std::string> told = writer->paths(*report.model);
  EXPECT_TRUE(fs::is_empty(folder_));
  auto simulation = Simulation::create(report.model, nullptr, writer);
  ASSERT_TRUE(simulation) << simulation.error().message;
  ASSERT_FALSE((*simulation)->run_until(0.05).error);
  ASSERT_TRUE(writer->finish());
  std::vector<std::string> written;
  for (const auto& entry : fs::directory_iterator(folder_)) written.push_back(entry.path());
  EXPECT_THAT(written, testing::IsSupersetOf({path("x.nc"), path("x.mov"), path("x_1.m")}));
  EXPECT_THAT(told, testing::IsSupersetOf(written));
}

/// A central field has no acceleration of its own.
TEST_F(ResultFilesTest, OnlyUniformGravityHasAFile) {
  const auto has_file = [&](const std::string& field) {
    std::string deck = kDeck;
    deck.replace(deck.find("output results: netcdf"), 22, "default output: all; gravity");
    deck.insert(deck.find("end: elements"), "gravity: " + field + ";\n");
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
    EXPECT_TRUE(report.ok());
    if (!report.ok()) return false;
    const auto writer = make_result_writer(*report.model, path(field.substr(0, 7)));
    auto simulation = Simulation::create(report.model, nullptr, writer);
    EXPECT_TRUE(simulation && !(*simulation)->run_until(0.05).error);
    EXPECT_TRUE(writer->finish());
    return fs::exists(path(field.substr(0, 7) + ".grv"));
  };
  EXPECT_TRUE(has_file("uniform, 0., 0., -1., 9.81"));
  EXPECT_FALSE(has_file("central, origin, 9., 0., 0., mass, 1., G, 1."));
}

TEST_F(ResultFilesTest, AFolderInTheWayIsToldBeforeAnythingIsCreated) {
  fs::create_directory(path("x_1.m"));
  std::ofstream(path("x.mov")) << "of an earlier run";
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", std::string(kDeck)}}), "deck.mbd");
  ASSERT_TRUE(report.ok());
  const auto simulation =
      Simulation::create(report.model, nullptr, make_result_writer(*report.model, path("x")));
  ASSERT_FALSE(simulation);
  EXPECT_EQ(simulation.error().message, "cannot write \"" + path("x_1.m") + "\": Is a directory");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2);
  EXPECT_EQ(fs::file_size(path("x.mov")), 17u);
}

}  // namespace
}  // namespace mbcosim::result_writer_test
