/// Result files follow the simulation back to earlier states.
#include "output/result_history.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "deck_run.h"
#include "output/result_files.h"

namespace mbcosim::result_history_test {
namespace {

namespace fs = std::filesystem;

// Two eigenanalyses, several kinds of files, every second step recorded.
const char* const kDeck = R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .1; time step: 1e-2; max iterations: 20; tolerance: 1e-9;
  derivatives tolerance: 1e-3; eigenanalysis: list, 2, 0., .04, parameter, .1, output eigenvectors;
end: initial value;
begin: control data; structural nodes: 3; rigid bodies: 2; joints: 2; forces: 1; gravity; default output: all;
  output results: netcdf; output frequency: 2; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, null, null, accelerations, yes;
  structural: 7, dynamic, 0.,1.,0., eye, null, 0.,0.,2.;
end: nodes;
begin: elements;
  body: 2, 2, 1.5, null, eye;
  body: 7, 7, 1., null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 3, rod, 1, 2, 1., linear elastic, 1000.;
  force: 4, absolute, 2, position, 0.,.5,0., 0.,1.,0., cosine, 0., 2*pi, 3., forever, 0.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";

ModelPtr model_of(const char* deck) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", std::string(deck)}}), "deck.mbd");
  EXPECT_TRUE(report.ok());
  return report.model;
}

/// A folder with the results of one simulation.
class Folder {
 public:
  Folder() {
    std::string path = testing::TempDir() + "mbcosim_history_XXXXXX";
    path_ = mkdtemp(path.data());
  }
  ~Folder() { fs::remove_all(path_); }
  std::shared_ptr<ResultHistory> writer(const Model& model) {
    auto files = make_result_writer(result_formats(model), path_ + "/r", &budget_);
    return std::make_shared<ResultHistory>(std::move(files), path_ + "/index", budget_);
  }
  /// Bytes by name, without the index.
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> found;
    for (const auto& entry : fs::directory_iterator(path_)) {
      std::ostringstream text;
      text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      found[entry.path().filename()] = text.str();
    }
    found.erase("index");
    return found;
  }
  std::string file(const std::string& name) const { return files()[name]; }
  ResultBudget& budget() { return budget_; }

 private:
  std::string path_;
  ResultBudget budget_{10 << 20};
};

class History : public testing::Test {
 protected:
  std::unique_ptr<Simulation> begin(Folder& folder) {
    writer_ = folder.writer(*model_);
    auto simulation = Simulation::create(model_, nullptr, writer_);
    EXPECT_TRUE(simulation) << simulation.error().message;
    return std::move(*simulation);
  }
  void finish(Simulation& simulation) {
    EXPECT_FALSE(simulation.run_until(1).error);
    const Status written = writer_->finish();
    EXPECT_TRUE(written) << written.error().message;
  }
  /// Files of the run without any detour.
  std::map<std::string, std::string> straight() {
    Folder folder;
    const auto simulation = begin(folder);
    finish(*simulation);
    return folder.files();
  }
  void expect_straight(const Folder& folder) {
    const auto expected = straight(), found = folder.files();
    ASSERT_GE(expected.size(), 8u);
    ASSERT_EQ(found.size(), expected.size());
    for (const auto& [name, bytes] : expected) EXPECT_TRUE(found.at(name) == bytes) << name;
  }

  const ModelPtr model_ = model_of(kDeck);
  std::shared_ptr<ResultHistory> writer_;
};

TEST_F(History, StartsAsTheFilesOfACommandLineRun) {
  Folder folder, plain;
  const auto simulation = begin(folder);
  finish(*simulation);
  ResultBudget none(1 << 30);
  const std::string prefix = testing::TempDir() + "mbcosim_history_plain";
  {
    const auto writer = make_result_writer(*model_, prefix);
    auto run = Simulation::create(model_, nullptr, writer);
    ASSERT_TRUE(run);
    (*run)->run_until(1);
    ASSERT_TRUE(writer->finish());
  }
  for (const auto& [name, bytes] : folder.files()) {
    std::ostringstream text;
    text << std::ifstream(prefix + name.substr(1), std::ios::binary).rdbuf();
    EXPECT_TRUE(text.str() == bytes) << name;
    fs::remove(prefix + name.substr(1));
  }
}

TEST_F(History, IsThatOfOneRunAfterRestores) {
  Folder folder;
  const auto simulation = begin(folder);
  const State start = simulation->snapshot();
  simulation->step_many(3);
  const State third = simulation->snapshot();
  simulation->step_many(4);
  ASSERT_TRUE(simulation->restore(third));
  simulation->step_many(1);
  ASSERT_TRUE(simulation->restore(start));
  simulation->step_many(6);
  ASSERT_TRUE(simulation->restore(simulation->snapshot()));
  finish(*simulation);
  expect_straight(folder);
}

TEST_F(History, OfAnEarlierStateHasNothingOfLaterOnes) {
  Folder folder;
  const auto simulation = begin(folder);
  simulation->step_many(3);
  const State third = simulation->snapshot();
  ASSERT_TRUE(writer_->flush(false));
  const std::string out = folder.file("r.out"), mov = folder.file("r.mov");
  const std::int64_t used = folder.budget().used();
  simulation->step_many(4);
  ASSERT_TRUE(writer_->flush(false));
  ASSERT_EQ(folder.files().count("r_1.m"), 1u);
  ASSERT_TRUE(simulation->restore(third));
  EXPECT_EQ(folder.files().count("r_1.m"), 0u);
  EXPECT_EQ(folder.file("r.out"), out);
  EXPECT_EQ(folder.file("r.mov"), mov);
  EXPECT_NEAR(static_cast<double>(folder.budget().used()), static_cast<double>(used), 3000)
      << "definitions and the index may stay";
}

TEST_F(History, GoesOnInAnotherProcess) {
  Folder folder;
  std::string state;
  {
    const auto simulation = begin(folder);
    simulation->step_many(5);
    state = simulation->export_state();
    ASSERT_TRUE(writer_->flush(true));
    simulation->step_many(3);
    ASSERT_TRUE(writer_->flush(false));  // then the process ends
    writer_.reset();
  }
  auto simulation = Simulation::create(model_);
  ASSERT_TRUE(simulation);
  ASSERT_TRUE((*simulation)->import_state(state));
  writer_ = folder.writer(*model_);
  const Status resumed = (*simulation)->resume_writing(writer_);
  ASSERT_TRUE(resumed) << resumed.error().message;
  finish(**simulation);
  expect_straight(folder);
}

TEST_F(History, OfAForkIsTheRestOfItsOriginals) {
  Folder folder, branch;
  const auto simulation = begin(folder);
  simulation->step_many(4);
  const auto fork = simulation->fork();
  writer_ = branch.writer(*model_);
  ASSERT_TRUE(fork->write_to(writer_));
  finish(*fork);
  const auto whole = straight(), rest = branch.files();
  for (const char* name : {"r.mov", "r.jnt", "r.ine", "r.frc"}) {
    const std::string& all = whole.at(name);
    const std::string& part = rest.at(name);
    ASSERT_GT(part.size(), 0u) << name;
    ASSERT_LT(part.size(), all.size()) << name;
    EXPECT_EQ(all.substr(all.size() - part.size()), part) << name;
  }
  EXPECT_EQ(rest.at("r.log"), whole.at("r.log"));
  EXPECT_NE(rest.at("r.out").find("# Begins at step 4, time 0.04\n"), std::string::npos);
}

TEST_F(History, SaysWhatIsMissingAfterAJumpAhead) {
  Folder folder;
  const auto simulation = begin(folder);
  simulation->step_many(2);
  const State second = simulation->snapshot();
  simulation->step_many(6);
  const State eighth = simulation->snapshot();
  ASSERT_TRUE(simulation->restore(second));
  writer_->expect(2);
  ASSERT_TRUE(simulation->restore(eighth));
  finish(*simulation);
  const std::string out = folder.file("r.out");
  EXPECT_NE(out.find("# Goes on after step 8: the steps between are not in these files\nStep 9 "),
            std::string::npos);
  EXPECT_EQ(out.find("\nStep 3 "), std::string::npos);
  EXPECT_NE(out.find("\nStep 2 "), std::string::npos);
}

TEST_F(History, EndsAtItsBudgetAndGoesOnAfterARestore) {
  Folder folder;
  ResultBudget small(14000);
  auto files =
      make_result_writer({ResultFormat::text}, testing::TempDir() + "mbcosim_small", &small);
  const auto writer =
      std::make_shared<ResultHistory>(files, testing::TempDir() + "mbcosim_small_index", small);
  auto simulation = Simulation::create(model_, nullptr, writer);
  ASSERT_TRUE(simulation);
  const State start = (*simulation)->snapshot();
  int steps = 0;
  while (writer->has_room() && !(*simulation)->finished()) {
    ASSERT_FALSE((*simulation)->step().error);
    ++steps;
  }
  EXPECT_GT(steps, 2);
  EXPECT_LT(steps, 10);
  EXPECT_TRUE(writer->flush(false)) << writer->status().error().message;
  ASSERT_TRUE((*simulation)->restore(start));
  EXPECT_TRUE(writer->has_room());
  for (const char* end :
       {".out", ".log", ".mov", ".ine", ".jnt", ".frc", ".act", "_0.m", "_1.m", "_index"})
    fs::remove(testing::TempDir() + "mbcosim_small" + end);
}

TEST(TextFile, KeepsWhatABudgetRefuses) {
  const std::string path = testing::TempDir() + "mbcosim_text_file";
  ResultBudget budget(10);
  TextFile file;
  file.open(path, &budget);
  file.text("twelve bytes");
  EXPECT_FALSE(file.flush());
  ASSERT_FALSE(file.status());
  EXPECT_EQ(file.status().error().kind, ErrorKind::limit);
  EXPECT_EQ(file.status().error().reason, "results_bytes");
  EXPECT_EQ(file.size(), 12);
  ASSERT_TRUE(file.cut(10));
  EXPECT_TRUE(file.retry());
  EXPECT_EQ(budget.used(), 10);
  EXPECT_TRUE(file.cut(TextFile::kNone));
  EXPECT_FALSE(fs::exists(path));
  EXPECT_EQ(budget.used(), 0);
}

}  // namespace
}  // namespace mbcosim::result_history_test
