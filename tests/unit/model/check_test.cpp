// Mistakes of elements are found where they are made: no array is overrun.
#include "model/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "elements/element.h"

namespace mbcosim::check_test {
namespace {

using testing::HasSubstr;

std::string message_of(const std::function<void(Connector&)>& connect) {
  ModelBuilder builder;
  Connection connection;
  Connector connector(connection, builder);
  try {
    connect(connector);
  } catch (const InternalError& error) {
    return error.what();
  }
  return "";
}

TEST(Check, AnElementWithMoreNodesThanThereIsRoomForIsRefused) {
  const auto nodes = [](int count) {
    return [count](Connector& c) {
      for (int k = 0; k < count; ++k) c.distinct_node(k);
    };
  };
  EXPECT_EQ(message_of(nodes(kMaxNodes)), "");
  EXPECT_THAT(message_of(nodes(kMaxNodes + 1)), HasSubstr("more nodes than there is room for"));
}

TEST(Check, AnElementWithMoreScalarDofsThanThereIsRoomForIsRefused) {
  const auto scalars = [](int count) {
    return [count](Connector& c) {
      for (int k = 0; k < count; ++k) c.scalar(k);
    };
  };
  EXPECT_EQ(message_of(scalars(kMaxScalars)), "");
  EXPECT_THAT(message_of(scalars(kMaxScalars + 1)), HasSubstr("more scalar dofs"));
}

TEST(Check, AnElementWithMoreUnknownsThanThereIsRoomForIsRefused) {
  EXPECT_EQ(message_of([](Connector& c) {
              c.algebraic(kMaxOwn - 1);
              c.differential(1);
            }),
            "");
  EXPECT_THAT(message_of([](Connector& c) {
                c.algebraic(kMaxOwn);
                c.differential(1);
              }),
              HasSubstr("more unknowns"));
}

TEST(Check, TheMessageNamesConditionAndPlaceWithoutFoldersOfTheBuild) {
  const std::string text = message_of([](Connector& c) { c.algebraic(kMaxOwn + 1); });
  EXPECT_THAT(text, testing::StartsWith("internal error: an element has more unknowns"));
  EXPECT_THAT(text, HasSubstr("(src/elements/element_view.h:"));
  EXPECT_THAT(text, HasSubstr("kMaxOwn"));
  EXPECT_THAT(text, HasSubstr("please report it"));
}

}  // namespace
}  // namespace mbcosim::check_test
