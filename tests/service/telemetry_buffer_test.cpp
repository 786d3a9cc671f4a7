#include "service/telemetry_buffer.h"

#include <gtest/gtest.h>

namespace mbcosim::server {
namespace {

using namespace std::chrono_literals;
using Taken = TelemetryBuffer::Taken;

TelemetryBuffer::Options options(v1::OverflowPolicy policy, std::size_t capacity) {
  TelemetryBuffer::Options result;
  result.policy = policy;
  result.capacity = capacity;
  result.block_timeout = 10ms;
  return result;
}

bool offer(TelemetryBuffer& buffer, std::int64_t step) {
  v1::Sample sample;
  sample.set_step(step);
  return buffer.offer(sample);
}

std::vector<std::int64_t> steps(const v1::TelemetryBatch& batch) {
  std::vector<std::int64_t> result;
  for (const auto& sample : batch.samples()) result.push_back(sample.step());
  return result;
}

TEST(TelemetryBuffer, DropOldestKeepsTheNewestAndCounts) {
  TelemetryBuffer buffer(options(v1::OVERFLOW_POLICY_DROP_OLDEST, 3));
  for (int step = 1; step <= 5; ++step) EXPECT_TRUE(offer(buffer, step));
  v1::TelemetryBatch batch;
  ASSERT_EQ(buffer.take(&batch, 0ms), Taken::samples);
  EXPECT_EQ(steps(batch), (std::vector<std::int64_t>{3, 4, 5}));
  EXPECT_EQ(batch.dropped(), 2);
  EXPECT_EQ(batch.samples(0).sequence(), 3);
  offer(buffer, 6);
  ASSERT_EQ(buffer.take(&batch, 0ms), Taken::samples);
  EXPECT_EQ(batch.dropped(), 0);
  EXPECT_EQ(batch.total_dropped(), 2);
}

TEST(TelemetryBuffer, DecimateHalvesAndWidens) {
  TelemetryBuffer buffer(options(v1::OVERFLOW_POLICY_DECIMATE, 4));
  for (int step = 1; step <= 4; ++step) offer(buffer, step);
  offer(buffer, 5);
  v1::TelemetryBatch batch;
  ASSERT_EQ(buffer.take(&batch, 0ms), Taken::samples);
  EXPECT_EQ(steps(batch), (std::vector<std::int64_t>{1, 3, 5}));
  EXPECT_EQ(batch.every(), 2);
  EXPECT_EQ(batch.dropped(), 2);
  EXPECT_TRUE(buffer.wants(6));
  EXPECT_FALSE(buffer.wants(7));
}

TEST(TelemetryBuffer, BlockRefusesUntilThereIsRoomAndEndsAStalledReader) {
  TelemetryBuffer buffer(options(v1::OVERFLOW_POLICY_BLOCK, 1));
  EXPECT_TRUE(offer(buffer, 1));
  EXPECT_FALSE(offer(buffer, 2));
  v1::TelemetryBatch batch;
  ASSERT_EQ(buffer.take(&batch, 0ms), Taken::samples);
  EXPECT_TRUE(offer(buffer, 2));
  for (int i = 0; i < 3; ++i) buffer.wait_for_room(5ms);
  EXPECT_TRUE(offer(buffer, 3));  // the subscription has ended: nobody waits for it any more
  EXPECT_EQ(buffer.take(&batch, 0ms), Taken::stalled);
}

TEST(TelemetryBuffer, CloseLetsTheRestBeTaken) {
  TelemetryBuffer buffer(options(v1::OVERFLOW_POLICY_DROP_OLDEST, 4));
  offer(buffer, 1);
  buffer.close();
  v1::TelemetryBatch batch;
  EXPECT_EQ(buffer.take(&batch, 0ms), Taken::samples);
  EXPECT_EQ(buffer.take(&batch, 0ms), Taken::closed);
}

}  // namespace
}  // namespace mbcosim::server
