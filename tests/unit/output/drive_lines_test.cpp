/// .drv, .trc and what the output meter makes of them, as the reference solver writes them.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "deck_run.h"
#include "output/result_files.h"

namespace mbcosim::drive_lines_test {
namespace {

namespace fs = std::filesystem;

class DriveLines : public testing::Test {
 protected:
  DriveLines()
      : folder_(fs::path(testing::TempDir()) /
                ("mbcosim_drives_" + std::to_string(reinterpret_cast<std::uintptr_t>(this)))) {
    fs::create_directories(folder_);
  }
  ~DriveLines() override { fs::remove_all(folder_); }

  void run(const std::string& control, const std::string& drives, double final_time) {
    const std::string deck =
        initial_value_block(.0625, final_time, "max iterations: 10; tolerance: 1e-6;") +
        "begin: control data; output precision: 4; " + control +
        " end: control data;\n"
        "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;\n"
        "begin: elements; body: 1, 1, 1., null, eye;\n" +
        drives + "\nend: elements;\n";
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
    ASSERT_TRUE(report.ok());
    auto writer = make_result_writer(*report.model, folder_ / "x");
    auto simulation = Simulation::create(report.model, nullptr, writer);
    ASSERT_TRUE(simulation) << simulation.error().message;
    ASSERT_FALSE((*simulation)->run_until(1e9).error);
    ASSERT_TRUE(writer->finish());
  }
  std::vector<std::string> lines(const char* extension) const {
    std::ifstream file(folder_ / (std::string("x.") + extension));
    std::vector<std::string> all;
    for (std::string line; std::getline(file, line);) all.push_back(line);
    return all;
  }

  const fs::path folder_;
};

TEST_F(DriveLines, YesIsTheValueAndTheDerivative) {
  run("",
      "drive caller: 123456789, time, output, yes; drive caller: 12, time, output, value, no, "
      "derivative, yes; drive caller: 11, string, \"Time\", output, yes; drive caller: 10, cubic, "
      "1., 2., 3., -1., output, yes, output trace, yes; drive caller: 9, time, output, value, yes, "
      "output trace, value, yes; drive caller: 8, time, output, no;",
      .01);
  EXPECT_THAT(lines("drv"),
              testing::ElementsAre("9 0.0000e+00", "10 1.0000e+00 2.0000e+00", "11 0.0000e+00",
                                   "12 1.0000e+00", "123456789 0.0000e+00 1.0000e+00",
                                   "9 6.2500e-02", "10 1.1365e+00 2.3633e+00", "11 6.2500e-02",
                                   "12 1.0000e+00", "123456789 6.2500e-02 1.0000e+00"));
  EXPECT_THAT(lines("trc"), testing::ElementsAre("9 0.0000e+00", "10 1.0000e+00 2.0000e+00",
                                                 "9 6.2500e-02", "10 1.1365e+00 2.3633e+00"));
}

TEST_F(DriveLines, DefaultIsTheValueAlone) {
  run("default output: drive callers;",
      "drive caller: 1, time; drive caller: 2, time, output, derivative, yes; drive caller: 3, "
      "time, output, no;",
      .01);
  EXPECT_THAT(lines("drv"), testing::ElementsAre("1 0.0000e+00", "2 0.0000e+00 1.0000e+00",
                                                 "1 6.2500e-02", "2 6.2500e-02 1.0000e+00"));
}

/// Records of 48 steps.
TEST_F(DriveLines, ClosestNextAsOutputMeter) {
  for (const auto& [increment, records] :
       {std::pair(".0625", 25), std::pair(".01", 25), std::pair(".1", 19), std::pair(".125", 25)}) {
    run("output meter: closest next, 0., forever, const, " + std::string(increment) + ";",
        "drive caller: 1, time, output, value, yes;", 3);
    EXPECT_EQ(lines("drv").size(), static_cast<std::size_t>(records)) << increment;
    EXPECT_EQ(lines("log").at(0), "output frequency: custom");
  }
}

TEST_F(DriveLines, TheLogTellsTheStepsOfAMeter) {
  const std::string meter = "output meter: meter, 0., forever";
  for (const auto& [more, frequency] : {std::pair(", steps, 5;", "5"), std::pair(";", "1")}) {
    run(meter + more, "", .125);
    EXPECT_EQ(lines("log").at(0), std::string("output frequency: ") + frequency);
  }
}

}  // namespace
}  // namespace mbcosim::drive_lines_test
