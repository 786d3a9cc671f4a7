#include "service/model_description.h"

#include <google/protobuf/util/message_differencer.h>

#include "direct_peer.h"
#include "thrown_mass.h"
#include "wire/refusal.h"

namespace mbcosim::server::model_description_test {
namespace {

using google::protobuf::util::MessageDifferencer;
using namespace std::chrono_literals;

class Description : public testing::Test {
 protected:
  Description() {
    DeckSymbol symbol;
    symbol.name = "k";
    symbol.declared = 3.5;
    symbol.value = 4.5;
    symbols_.push_back(symbol);
  }
  v1::DescribeSimulationReply described() const {
    v1::DescribeSimulationReply reply;
    describe({simulation_->model(), simulation_->variables(), symbols_, coupler_.ports()}, request_,
             &reply);
    return reply;
  }
  /// The pages from the first to the last, joined.
  v1::ModelDescription joined(int size) {
    v1::ModelDescription all;
    request_.set_page_size(size);
    do {
      const v1::DescribeSimulationReply reply = described();
      const v1::ModelDescription& page = reply.model();
      const int entries = page.nodes_size() + page.elements_size() + page.variables_size();
      EXPECT_LE(entries, size);
      EXPECT_TRUE(entries == size || reply.next_page_token().empty());
      EXPECT_EQ(page.symbols_size(), request_.page_token().empty() ? 1 : 0);
      EXPECT_EQ(page.ports_size(), request_.page_token().empty() ? 1 : 0);
      v1::ModelDescription lists = page;
      if (!request_.page_token().empty()) {
        lists.Clear();
        *lists.mutable_nodes() = page.nodes();
        *lists.mutable_elements() = page.elements();
        *lists.mutable_variables() = page.variables();
      }
      all.MergeFrom(lists);
      request_.set_page_token(reply.next_page_token());
    } while (!request_.page_token().empty());
    return all;
  }
  v1::ErrorInfo refusal() const {
    v1::ErrorInfo info;
    try {
      described();
    } catch (const Refusal& refusal) {
      v1::ErrorStatus details;
      EXPECT_TRUE(details.ParseFromString(refusal.status().error_details()));
      EXPECT_TRUE(info.ParseFromString(details.details(0).value()));
    }
    return info;
  }

  const std::unique_ptr<Simulation> simulation_ = thrown_mass();
  const Coupler coupler_{spring_port(), *simulation_, 1000ms};
  std::vector<DeckSymbol> symbols_;
  v1::DescribeSimulationRequest request_;
};

TEST_F(Description, TellsNodesElementsVariablesSymbolsAndPorts) {
  const v1::DescribeSimulationReply reply = described();
  const v1::ModelDescription& model = reply.model();
  EXPECT_EQ(reply.next_page_token(), "");
  EXPECT_EQ(model.unknowns(), simulation_->model().unknowns);
  ASSERT_EQ(model.nodes_size(), 2);
  EXPECT_EQ(model.nodes(0).family(), "structural");
  EXPECT_EQ(model.nodes(1).family(), "parameter");
  EXPECT_EQ(model.nodes(1).label(), 2);
  ASSERT_EQ(model.elements_size(), 2);
  EXPECT_EQ(model.elements(0).family(), "body");
  EXPECT_EQ(model.elements(1).family(), "force");
  ASSERT_EQ(model.variables_size(), std::ssize(simulation_->variables()));
  for (int i = 0; i < model.variables_size(); ++i) {
    EXPECT_EQ(model.variables(i).handle(), i);
    EXPECT_EQ(model.variables(i).name(), simulation_->variables()[i].name);
  }
  ASSERT_EQ(model.symbols_size(), 1);
  EXPECT_EQ(model.symbols(0).declared().number(), 3.5);
  EXPECT_EQ(model.symbols(0).value().number(), 4.5);
  ASSERT_EQ(model.ports_size(), 1);
  EXPECT_EQ(model.ports(0).name(), "spring");
}

TEST_F(Description, InPagesIsTheWholeOne) {
  const v1::ModelDescription whole = described().model();
  const int entries = whole.nodes_size() + whole.elements_size() + whole.variables_size();
  for (const int size : {1, 3, 7, entries - 1, entries, entries + 1})
    EXPECT_TRUE(MessageDifferencer::Equals(joined(size), whole)) << size;
}

TEST_F(Description, OfAPrefixHasOnlyVariablesThatStartSo) {
  request_.set_variable_prefix("node.structural.1.");
  const v1::ModelDescription model = described().model();
  EXPECT_EQ(model.nodes_size(), 2);
  std::vector<std::string> expected, told;
  for (const Variable& v : simulation_->variables())
    if (v.name.starts_with("node.structural.1.")) expected.push_back(v.name);
  for (const v1::Variable& v : model.variables()) {
    told.push_back(v.name());
    EXPECT_EQ(v.handle(), simulation_->find_variable(v.name()));
  }
  EXPECT_FALSE(expected.empty());
  EXPECT_LT(expected.size(), simulation_->variables().size());
  EXPECT_EQ(told, expected);
  EXPECT_TRUE(MessageDifferencer::Equals(joined(3), model));
}

TEST_F(Description, OfNamesHasTheseInTheirOrderAndNothingElse) {
  for (const char* name : {"node.parameter.2.x", "time", "node.parameter.2.x"})
    request_.add_variable_names(name);
  const v1::ModelDescription model = described().model();
  ASSERT_EQ(model.variables_size(), 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(model.variables(i).name(), request_.variable_names(i));
    EXPECT_EQ(model.variables(i).handle(), simulation_->find_variable(request_.variable_names(i)));
  }
  EXPECT_EQ(model.nodes_size() + model.elements_size() + model.symbols_size() + model.ports_size(),
            0);
}

TEST_F(Description, NamesTheVariableThatThereIsNot) {
  request_.add_variable_names("time");
  request_.add_variable_names("tiem");
  const v1::ErrorInfo info = refusal();
  EXPECT_EQ(info.reason(), "NO_SUCH_VARIABLE");
  EXPECT_EQ(info.metadata().at("name"), "tiem");
}

TEST_F(Description, RefusesTokensThatAreNotItsOwn) {
  for (const char* token : {"next", "-1", "0", "3 ", "3x", "99999999999999999999"}) {
    request_.set_page_token(token);
    EXPECT_EQ(refusal().reason(), "BAD_ARGUMENT") << token;
  }
}

TEST_F(Description, RefusesPagesOfNothing) {
  for (const int size : {0, -1}) {
    request_.set_page_size(size);
    EXPECT_EQ(refusal().reason(), "BAD_ARGUMENT") << size;
  }
}

}  // namespace
}  // namespace mbcosim::server::model_description_test
