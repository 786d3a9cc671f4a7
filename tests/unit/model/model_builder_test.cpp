#include <gtest/gtest.h>

#include <vector>

#include "model/context.h"
#include "model/model.h"
#include "model/state.h"

namespace mbcosim::model_builder_test {
namespace {

/// Values that drives and laws start with are what they see while the deck is read, also those that
/// are set after something has looked.
TEST(ModelBuilder, TheInputContextHasTheInitialMemory) {
  ModelBuilder builder;
  EXPECT_TRUE(builder.input_context().state->memory.empty());
  const int first = builder.allocate_memory(2, 1.5);
  EXPECT_EQ(builder.input_context().state->memory, (std::vector<double>{1.5, 1.5}));
  builder.set_memory(first + 1, -3);
  EXPECT_EQ(builder.input_context().state->memory, (std::vector<double>{1.5, -3}));
  const int second = builder.allocate_memory(1);
  builder.set_memory(second, 7);
  EXPECT_EQ(builder.input_context().state->memory, (std::vector<double>{1.5, -3, 7}));
  EXPECT_EQ(builder.input_context().state->memory, builder.model().initial_memory);
}

}  // namespace
}  // namespace mbcosim::model_builder_test
