#include "service/telemetry_hub.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cstdio>

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
using Wire = google::protobuf::internal::WireFormatLite;
constexpr std::int64_t kSampleBytes = 96;       ///< of one sample, besides its values
constexpr std::chrono::milliseconds kRound(5);  // shortest time between two rounds of waking

/// The sample with its number in the subscription, which alone differs among equal ones.
void append(const std::string& sample, std::int64_t sequence,
            google::protobuf::io::CodedOutputStream& out) {
  using Coded = google::protobuf::io::CodedOutputStream;
  constexpr auto kSamples =
      Wire::MakeTag(v1::TelemetryBatch::kSamplesFieldNumber, Wire::WIRETYPE_LENGTH_DELIMITED);
  constexpr auto kSequence = Wire::MakeTag(v1::Sample::kSequenceFieldNumber, Wire::WIRETYPE_VARINT);
  const auto number = static_cast<std::uint64_t>(sequence);
  out.WriteTag(kSamples);
  out.WriteVarint32(static_cast<std::uint32_t>(sample.size() + Coded::VarintSize32(kSequence) +
                                               Coded::VarintSize64(number)));
  out.WriteString(sample);
  out.WriteTag(kSequence);
  out.WriteVarint64(number);
}

}  // namespace

/// Serialized samples of the variables that equal subscriptions ask for, without their numbers.
struct Feed {
  std::vector<int> handles;
  std::int64_t every = 1;
  std::int64_t keep = 0;   ///< samples, the most that one of its subscribers wants kept
  MemoryShare share;       ///< of so many
  std::int64_t first = 0;  ///< number of the oldest
  std::deque<std::shared_ptr<const std::string>> samples = {};
  int users = 0;
  std::int64_t end() const { return first + static_cast<std::int64_t>(samples.size()); }
};

TelemetryHub::TelemetryHub(MemoryBudget& memory, Lanes& lanes, Timer& timer)
    : memory_(memory), lanes_(lanes), timer_(timer) {}

TelemetryHub::~TelemetryHub() = default;

// ------------------------------------------------------------------ coming and going

void TelemetryHub::add(const SubscriptionPtr& subscription, std::int64_t values) {
  Guard guard(mutex_);
  const Subscription::Options& o = subscription->options;
  const std::int64_t keep = o.capacity + 1;  // one more while the session waits for room
  const std::int64_t sample_bytes =
      kSampleBytes + values * static_cast<std::int64_t>(sizeof(double));
  auto feed = std::find_if(feeds_.begin(), feeds_.end(), [&](const Feed& known) {
    return known.every == o.every && known.handles == o.handles;
  });
  MemoryShare share(memory_, static_cast<std::int64_t>(o.handles.size() * sizeof(int)));
  if (o.policy == v1::OVERFLOW_POLICY_DECIMATE)
    subscription->share = MemoryShare(memory_, keep * sample_bytes);
  if (feed == feeds_.end()) {
    share.grow(keep * sample_bytes);
    feed = feeds_.insert(feeds_.end(), Feed{o.handles, o.every, keep, std::move(share)});
  } else if (keep > feed->keep) {
    feed->share.grow((keep - feed->keep) * sample_bytes);
    feed->keep = keep;
  }
  ++feed->users;
  subscription->feed = &*feed;
  subscription->first = subscription->next = feed->end();
  subscriptions_.push_back(subscription);
  if (o.policy == v1::OVERFLOW_POLICY_BLOCK) blockers_.push_back(subscription);
  if (o.policy == v1::OVERFLOW_POLICY_DECIMATE) decimators_.push_back(subscription);
  some_.store(true);
  if (closed_) schedule();
}

void TelemetryHub::remove(const SubscriptionPtr& subscription) {
  Guard guard(mutex_);
  if (std::erase(subscriptions_, subscription) == 0) return;
  std::erase(blockers_, subscription);
  std::erase(decimators_, subscription);
  Feed* feed = std::exchange(subscription->feed, nullptr);
  if (--feed->users == 0) feeds_.remove_if([&](const Feed& known) { return &known == feed; });
  some_.store(!subscriptions_.empty());
  look_for_blocks();
  room_.notify_all();
}

void TelemetryHub::close() {
  Guard guard(mutex_);
  closed_ = true;
  room_.notify_all();
  schedule();
}

// ------------------------------------------------------------------ the session's thread

std::string TelemetryHub::sample(const Simulation& simulation, const Feed& feed) {
  values_.clear();
  for (const int handle : feed.handles) simulation.get(handle, values_);
  scratch_.Clear();
  scratch_.set_step(simulation.step_number());
  scratch_.set_time_s(simulation.time());
  scratch_.mutable_values()->Add(values_.begin(), values_.end());
  return scratch_.SerializeAsString();
}

void TelemetryHub::publish(const Simulation& simulation) {
  Guard guard(mutex_);
  if (closed_) return;
  for (Feed& feed : feeds_) {
    if (simulation.step_number() % feed.every != 0) continue;
    feed.samples.push_back(std::make_shared<const std::string>(sample(simulation, feed)));
    for (const SubscriptionPtr& s : decimators_)
      if (s->feed == &feed) keep_for(*s, feed);
    while (static_cast<std::int64_t>(feed.samples.size()) > feed.keep) {
      feed.samples.pop_front();
      ++feed.first;
    }
    news_ = true;
  }
  if (!blockers_.empty()) look_for_blocks();
  if (news_) schedule();
}

void TelemetryHub::look_for_blocks() {
  bool blocked = false;
  for (const SubscriptionPtr& s : blockers_) {
    const bool full = !s->stalled && !closed_ && s->feed->end() - s->next > s->options.capacity;
    if (!full)
      s->blocks_since = {};
    else if (s->blocks_since == Clock::time_point())
      s->blocks_since = Clock::now();
    blocked = blocked || full;
  }
  blocked_.store(blocked);
}

void TelemetryHub::wait_for_room(std::chrono::milliseconds slice) {
  const Clock::time_point end = Clock::now() + slice;
  Guard guard(mutex_);
  while (blocked() && !closed_ && Clock::now() < end) room_.wait_until(mutex_, end);
  for (const SubscriptionPtr& s : blockers_) {
    const bool blocks = s->blocks_since != Clock::time_point();
    if (!blocks || Clock::now() - s->blocks_since < s->options.block_timeout) continue;
    s->stalled = true;
    schedule();
  }
  look_for_blocks();
}

std::string TelemetryHub::waiting_for() const {
  Guard guard(mutex_);
  std::string text;
  for (const SubscriptionPtr& s : blockers_) {
    if (s->blocks_since == Clock::time_point()) continue;
    char since[64];
    std::snprintf(since, sizeof since, " since %.1f s",
                  std::chrono::duration<double>(Clock::now() - s->blocks_since).count());
    text += (text.empty() ? "subscriber " : ", subscriber ") + s->options.identity + since;
  }
  return text;
}

// ------------------------------------------------------------------ waking

void TelemetryHub::schedule() {
  if (std::exchange(scheduled_, true)) return;
  lanes_.post(Lane::quick, "", [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->wake_all();
  });
}

void TelemetryHub::wake_all() {
  std::vector<SubscriptionPtr> all;
  {
    Guard guard(mutex_);
    news_ = false;
    all = subscriptions_;
  }
  for (const SubscriptionPtr& s : all) s->options.wake();
  timer_.after(kRound, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->rest();
  });
}

// The next round comes at once when there was news meanwhile.
void TelemetryHub::rest() {
  Guard guard(mutex_);
  scheduled_ = false;
  if (news_) schedule();
}

// ------------------------------------------------------------------ a subscriber

TelemetryHub::Taken TelemetryHub::take(Subscription& s, std::size_t most_bytes,
                                       std::string* batch) {
  Guard guard(mutex_);
  if (!s.feed) return Taken::closed;
  if (s.stalled) return Taken::stalled;
  const bool thinned = s.options.policy == v1::OVERFLOW_POLICY_DECIMATE;
  drop_what_is_late(s);
  if (thinned ? s.kept.empty() : s.next >= s.feed->end())
    return closed_ ? Taken::closed : Taken::nothing;
  v1::TelemetryBatch rest;
  s.total_dropped += s.dropped;
  rest.set_dropped(std::exchange(s.dropped, 0));
  rest.set_total_dropped(s.total_dropped);
  rest.set_every(s.options.every * s.stride);
  batch->clear();
  {
    google::protobuf::io::StringOutputStream stream(batch);
    google::protobuf::io::CodedOutputStream out(&stream);
    const auto room = [&] { return static_cast<std::size_t>(out.ByteCount()) < most_bytes; };
    for (; !s.kept.empty() && room(); s.kept.pop_front())
      append(*s.kept.front().sample, s.kept.front().sequence, out);
    for (; !thinned && s.next < s.feed->end() && room(); ++s.next)
      append(*s.feed->samples[static_cast<std::size_t>(s.next - s.feed->first)], ++s.sequence, out);
    rest.SerializeToCodedStream(&out);
  }
  if (s.blocks_since != Clock::time_point()) {
    look_for_blocks();
    room_.notify_all();
  }
  return Taken::samples;
}

void TelemetryHub::drop_what_is_late(Subscription& s) {
  if (s.options.policy != v1::OVERFLOW_POLICY_DROP_OLDEST) return;
  const std::int64_t late = s.feed->end() - s.options.capacity - s.next;
  if (late <= 0) return;
  s.next += late;
  s.sequence += late;
  s.dropped += late;
}

// The newest sample of the feed, if it is one of those that the subscription still takes.
void TelemetryHub::keep_for(Subscription& s, const Feed& feed) {
  if ((feed.end() - 1 - s.first) % s.stride != 0) return;
  if (static_cast<std::int64_t>(s.kept.size()) >= s.options.capacity) decimate(s);
  s.kept.push_back({feed.samples.back(), ++s.sequence});
}

// Every other sample goes; a buffer for one cannot be halved.
void TelemetryHub::decimate(Subscription& s) {
  std::deque<Subscription::Kept> rest;
  for (std::size_t i = 0; i < s.kept.size(); i += 2) rest.push_back(std::move(s.kept[i]));
  if (static_cast<std::int64_t>(rest.size()) >= s.options.capacity) rest.pop_front();
  s.dropped += static_cast<std::int64_t>(s.kept.size() - rest.size());
  s.kept = std::move(rest);
  s.stride *= 2;
}

}  // namespace mbcosim::server
