#include "service/event_journal.h"

#include <google/protobuf/util/time_util.h>

#include <cstdio>
#include <random>
#include <utility>
#include <vector>

namespace mbcosim::server {
namespace {

std::string random_name() {
  std::random_device random;
  char text[24];
  std::snprintf(text, sizeof text, "%08x%08x", random(), random());
  return text;
}

}  // namespace

EventJournal::EventJournal() : name_(random_name()) {}

std::int64_t EventJournal::last() const {
  Guard guard(mutex_);
  return last_;
}

void EventJournal::add(v1::Event event, const std::string& owner) {
  *event.mutable_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  std::vector<std::function<void()>> wakes;
  {
    Guard guard(mutex_);
    event.set_sequence(++last_);
    const std::size_t bytes = event.ByteSizeLong() + sizeof(Kept) + owner.size();
    kept_.push_back({std::move(event), owner, bytes});
    bytes_ += bytes;
    while (kept_.size() > kMostEvents || bytes_ > kMostBytes) {
      bytes_ -= kept_.front().bytes;
      kept_.pop_front();
    }
    for (const ReaderPtr& reader : readers_)
      if (std::exchange(reader->waits, false)) wakes.push_back(reader->wake);
  }
  for (const auto& wake : wakes) wake();
}

void EventJournal::enter(const ReaderPtr& reader) {
  Guard guard(mutex_);
  readers_.push_back(reader);
}

void EventJournal::leave(const ReaderPtr& reader) {
  Guard guard(mutex_);
  readers_.remove(reader);
}

bool EventJournal::next(Reader& reader, v1::Event* out) {
  Guard guard(mutex_);
  out->Clear();
  const std::int64_t first = last_ - static_cast<std::int64_t>(kept_.size()) + 1;
  if (reader.next < first) {
    out->mutable_missed()->set_count(first - std::exchange(reader.next, first));
    return true;
  }
  while (reader.next <= last_) {
    const Kept& kept = kept_[static_cast<std::size_t>(reader.next++ - first)];
    if (!reader.wants(kept.event, kept.owner)) continue;
    *out = kept.event;
    return true;
  }
  reader.waits = true;
  return false;
}

}  // namespace mbcosim::server
