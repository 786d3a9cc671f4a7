#include "service/telemetry_hub.h"

namespace mbcosim::server {

bool TelemetryHub::Pending::deliver() {
  constexpr std::chrono::milliseconds kSlice(20);  // longest wait before looking round
  for (auto& [buffer, sample] : waiting_) buffer->wait_for_room(kSlice);
  std::erase_if(waiting_, [](auto& pending) { return pending.first->offer(pending.second); });
  return waiting_.empty();
}

void TelemetryHub::add(std::shared_ptr<TelemetryBuffer> buffer) {
  std::lock_guard guard(mutex_);
  if (closed_) buffer->close();
  buffers_.push_back(std::move(buffer));
  some_.store(true);
}

void TelemetryHub::remove(const std::shared_ptr<TelemetryBuffer>& buffer) {
  buffer->close();
  std::lock_guard guard(mutex_);
  std::erase(buffers_, buffer);
  some_.store(!buffers_.empty());
}

void TelemetryHub::publish(const Simulation& simulation, Pending& pending) {
  std::lock_guard guard(mutex_);
  for (const auto& buffer : buffers_) {
    if (!buffer->wants(simulation.step_number())) continue;
    v1::Sample sample;
    sample.set_step(simulation.step_number());
    sample.set_time_s(simulation.time());
    values_.clear();
    for (const int handle : buffer->handles()) simulation.get(handle, values_);
    sample.mutable_values()->Add(values_.begin(), values_.end());
    if (!buffer->offer(sample)) pending.waiting_.emplace_back(buffer, std::move(sample));
  }
}

void TelemetryHub::close() {
  std::lock_guard guard(mutex_);
  closed_ = true;
  for (const auto& buffer : buffers_) buffer->close();
}

}  // namespace mbcosim::server
