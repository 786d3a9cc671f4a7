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

}  // namespace
}  // namespace mbcosim::model_log_test
