/// The text of the `.log` file.
#include "output/model_log.h"

#include <gmock/gmock.h>

#include "deck_run.h"

namespace mbcosim::model_log_test {
namespace {

std::string log_of(const std::string& counts, const std::string& node) {
  const std::string deck = initial_value_block(.1, 1) + "begin: control data; abstract nodes: 1; " +
                           counts + "genels: 1; end: control data;\nbegin: nodes; abstract: 1; " +
                           node +
                           "end: nodes;\nbegin: elements; genel: 1, spring support, 1, abstract, "
                           "algebraic, linear elastic, 1.; end: elements;\n";
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  EXPECT_TRUE(report.ok());
  return report.ok() ? model_log(*report.model) : "";
}

/// As the reference solver: where there are some, the lists of other kinds of nodes stand there
/// without numbers.
TEST(ModelLog, ListsIndicesOnlyOfModelsWithStructuralNodes) {
  EXPECT_THAT(log_of("", ""), testing::StartsWith("output frequency: 1\nSymbol table:\n"));
  EXPECT_THAT(log_of("structural nodes: 1; ", "structural: 7, dynamic displacement, null, null; "),
              testing::HasSubstr("\nstruct node labels:\nstruct displacement node labels: 7\n"));
}

/// As the manual has it, but that `yes` and `both`, which ask for the standard output, are written
/// there, too. The reference solver prints all of them on the standard output.
TEST(ModelLog, HasInertiaCards) {
  const auto log = [](const std::string& output) {
    const std::string deck =
        initial_value_block(.1, 1) +
        "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;\n"
        "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;\n"
        "begin: elements; body: 1, 1, 2., null, diag, 1., 2., 3.; inertia: 7, name, \"all\", body, "
        "all" +
        output + "; end: elements;\n";
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
    EXPECT_TRUE(report.ok());
    return report.ok() ? model_log(*report.model) : "";
  };
  for (const char* output : {"", ", output, log", ", output, yes", ", output, both"})
    EXPECT_THAT(log(output), testing::HasSubstr("\ninertia: 7 \"all\"\n    mass: 2\n")) << output;
  EXPECT_THAT(log(", output, no"), testing::Not(testing::HasSubstr("inertia: 7")));
}

}  // namespace
}  // namespace mbcosim::model_log_test
