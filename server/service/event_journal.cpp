#include "service/event_journal.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
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

void EventJournal::add(v1::Event event, RightsPtr rights) {
  *event.mutable_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  std::vector<std::function<void()>> wakes;
  {
    Guard guard(mutex_);
    event.set_sequence(++last_);
    if (event.has_checkpoint()) drop_checkpoint_before(event);
    const std::size_t bytes = event.ByteSizeLong() + sizeof(Kept) + rights->bytes();
    kept_.push_back({std::move(event), std::move(rights), bytes});
    bytes_ += bytes;
    while (kept_.size() > kMostEvents || bytes_ > kMostBytes) {
      bytes_ -= kept_.front().bytes;
      gone_ = kept_.front().event.sequence();
      kept_.pop_front();
    }
    for (const ReaderPtr& reader : readers_)
      if (std::exchange(reader->waits, false)) wakes.push_back(reader->wake);
  }
  for (const auto& wake : wakes) wake();
}

// There are many of them, and what else has happened must not make room for them.
void EventJournal::drop_checkpoint_before(const v1::Event& event) {
  const auto last = std::find_if(kept_.rbegin(), kept_.rend(), [&](const Kept& kept) {
    return kept.event.has_checkpoint() && kept.event.simulation() == event.simulation();
  });
  if (last == kept_.rend()) return;
  bytes_ -= last->bytes;
  kept_.erase(std::prev(last.base()));
}

void EventJournal::enter(const ReaderPtr& reader) {
  Guard guard(mutex_);
  readers_.push_back(reader);
}

void EventJournal::leave(const ReaderPtr& reader) {
  Guard guard(mutex_);
  readers_.remove(reader);
}

bool EventJournal::next(Reader& reader, v1::Event* out, RightsPtr* rights) {
  Guard guard(mutex_);
  out->Clear();
  rights->reset();
  if (reader.next <= gone_) {
    out->mutable_missed()->set_count(gone_ + 1 - std::exchange(reader.next, gone_ + 1));
    return true;
  }
  auto kept = std::lower_bound(
      kept_.begin(), kept_.end(), reader.next,
      [](const Kept& each, std::int64_t number) { return each.event.sequence() < number; });
  reader.next = last_ + 1;
  for (; kept != kept_.end(); ++kept) {
    if (!reader.wants(kept->event, *kept->rights)) continue;
    reader.next = kept->event.sequence() + 1;
    *out = kept->event;
    *rights = kept->rights;
    return true;
  }
  reader.waits = true;
  return false;
}

}  // namespace mbcosim::server
