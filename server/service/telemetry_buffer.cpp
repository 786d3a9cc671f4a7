#include "service/telemetry_buffer.h"

namespace mbcosim::server {

bool TelemetryBuffer::wants(std::int64_t step) const {
  std::lock_guard guard(mutex_);
  return !closed_ && !stalled_ && step % every_ == 0;
}

bool TelemetryBuffer::offer(v1::Sample& sample) {
  std::lock_guard guard(mutex_);
  if (closed_ || stalled_) return true;
  if (samples_.size() >= options_.capacity) {
    switch (options_.policy) {
      case v1::OVERFLOW_POLICY_BLOCK:
        return false;
      case v1::OVERFLOW_POLICY_DECIMATE:
        decimate();
        break;
      default:
        samples_.pop_front();
        ++dropped_;
    }
  }
  sample.set_sequence(++sequence_);
  samples_.push_back(std::move(sample));
  blocked_ = std::chrono::milliseconds(0);
  filled_.notify_one();
  return true;
}

void TelemetryBuffer::decimate() {
  std::deque<v1::Sample> kept;
  for (std::size_t i = 0; i < samples_.size(); i += 2) kept.push_back(std::move(samples_[i]));
  dropped_ += static_cast<std::int64_t>(samples_.size() - kept.size());
  samples_ = std::move(kept);
  if (samples_.size() >= options_.capacity) {  // a buffer for one sample cannot be halved
    samples_.pop_front();
    ++dropped_;
  }
  every_ *= 2;
}

void TelemetryBuffer::wait_for_room(std::chrono::milliseconds slice) {
  std::unique_lock guard(mutex_);
  const bool room = emptied_.wait_for(
      guard, slice, [&] { return closed_ || samples_.size() < options_.capacity; });
  if (room) return;
  blocked_ += slice;
  if (blocked_ < options_.block_timeout) return;
  stalled_ = true;
  filled_.notify_one();
}

void TelemetryBuffer::close() {
  std::lock_guard guard(mutex_);
  closed_ = true;
  filled_.notify_one();
  emptied_.notify_one();
}

TelemetryBuffer::Taken TelemetryBuffer::take(v1::TelemetryBatch* batch,
                                             std::chrono::milliseconds slice) {
  std::unique_lock guard(mutex_);
  filled_.wait_for(guard, slice, [&] { return closed_ || stalled_ || !samples_.empty(); });
  if (stalled_) return Taken::stalled;
  if (samples_.empty()) return closed_ ? Taken::closed : Taken::nothing;
  batch->clear_samples();
  for (v1::Sample& sample : samples_) *batch->add_samples() = std::move(sample);
  samples_.clear();
  total_dropped_ += dropped_;
  batch->set_dropped(dropped_);
  batch->set_total_dropped(total_dropped_);
  batch->set_every(every_);
  dropped_ = 0;
  emptied_.notify_one();
  return Taken::samples;
}

}  // namespace mbcosim::server
