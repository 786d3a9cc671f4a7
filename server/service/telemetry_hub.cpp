#include "service/telemetry_hub.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
using Wire = google::protobuf::internal::WireFormatLite;
constexpr std::int64_t kSampleBytes = 96;       ///< of one sample, besides its values
constexpr std::int64_t kSerialized = 64 << 10;  ///< bytes of samples kept for equal subscriptions
constexpr std::int64_t kLookForLate = 64;       // samples between two looks at who reads too late
constexpr std::chrono::milliseconds kRound(5);  // shortest time between two rounds of waking
constexpr std::chrono::seconds kLastRead(10);   // that long the end waits for readers

/// The sample with its number in the subscription, which alone differs among equal ones.
void append(const std::string& sample, std::int64_t sequence,
            google::protobuf::io::CodedOutputStream& out) {
  using Coded = google::protobuf::io::CodedOutputStream;
  constexpr auto kSamples =
      Wire::MakeTag(v1::SubscribeReply::kSamplesFieldNumber, Wire::WIRETYPE_LENGTH_DELIMITED);
  constexpr auto kSequence = Wire::MakeTag(v1::Sample::kSequenceFieldNumber, Wire::WIRETYPE_VARINT);
  const auto number = static_cast<std::uint64_t>(sequence);
  out.WriteTag(kSamples);
  out.WriteVarint32(static_cast<std::uint32_t>(sample.size() + Coded::VarintSize32(kSequence) +
                                               Coded::VarintSize64(number)));
  out.WriteString(sample);
  out.WriteTag(kSequence);
  out.WriteVarint64(number);
}

/// Bytes of a sample that is longer than all that is usually kept.
std::int64_t beyond_usual(std::int64_t sample_bytes) {
  return std::max<std::int64_t>(0, sample_bytes - kSerialized);
}

}  // namespace

/// What equal subscriptions have in common: their samples, serialized when the first of them takes
/// them, without their numbers.
struct Feed {
  Rhythm rhythm;
  std::vector<int> handles;
  Track* track = nullptr;
  std::vector<const Track::Column*> columns = {};  ///< (handles)
  MemoryShare share;                               ///< of handles and serialized samples
  std::int64_t first = 0;                          ///< number of the oldest that is serialized
  std::deque<std::string> serialized = {};         ///< at most kSerialized bytes
  std::size_t bytes = 0;                           ///< of them
  int users = 0;
  std::int64_t end() const { return first + static_cast<std::int64_t>(serialized.size()); }
};

TelemetryHub::TelemetryHub(MemoryBudget& memory, Lanes& lanes, Timer& timer, Metrics* metrics)
    : memory_(memory), lanes_(lanes), timer_(timer), metrics_(metrics) {}

TelemetryHub::~TelemetryHub() = default;

// ------------------------------------------------------------------ coming and going

void TelemetryHub::add(const SubscriptionPtr& subscription, std::span<const int> sizes) {
  Guard guard(mutex_);
  const Subscription::Options& o = subscription->options;
  const std::int64_t sample_bytes =
      kSampleBytes + std::accumulate(sizes.begin(), sizes.end(), std::int64_t{0}) *
                         static_cast<std::int64_t>(sizeof(double));
  const bool thinned = o.policy == v1::OVERFLOW_POLICY_DECIMATE;
  // A long one stands in the batch, in its message and with gRPC at the same time.
  const std::int64_t on_the_way = sample_bytes + 2 * beyond_usual(sample_bytes);
  MemoryShare share(memory_,
                    o.batch_bytes + on_the_way + (thinned ? o.capacity * sample_bytes : 0));
  Feed& feed = feed_for(o, sizes, sample_bytes);
  subscription->share = std::move(share);
  ++feed.users;
  subscription->feed = &feed;
  subscription->first = subscription->next = feed.track->end();
  subscriptions_.push_back(subscription);
  ++hungry_;
  if (o.policy == v1::OVERFLOW_POLICY_BLOCK) blockers_.push_back(subscription);
  if (thinned) decimators_.push_back(subscription);
  some_.store(true);
  if (closed_) schedule();
}

Feed& TelemetryHub::feed_for(const Subscription::Options& o, std::span<const int> sizes,
                             std::int64_t sample_bytes) {
  const std::int64_t keep = o.capacity + 1;  // one more while the session waits for room
  const auto feed = std::find_if(feeds_.begin(), feeds_.end(), [&](const Feed& known) {
    return known.rhythm == o.rhythm && known.handles == o.handles;
  });
  if (feed != feeds_.end()) {
    feed->track->lengthen_to(keep);
    return *feed;
  }
  // A sample may be longer than all that is kept, and is made in two places.
  MemoryShare share(memory_,
                    kSerialized + 3 * beyond_usual(sample_bytes) +
                        static_cast<std::int64_t>(o.handles.size()) *
                            static_cast<std::int64_t>(sizeof(int) + sizeof(Track::Column*)));
  Track& track = tracks_.try_emplace(o.rhythm, memory_).first->second.track;
  try {
    track.want(o.handles, sizes, keep);
  } catch (...) {
    if (!track.is_wanted()) tracks_.erase(o.rhythm);
    throw;
  }
  Feed& fresh = feeds_.emplace_back(Feed{o.rhythm, o.handles, &track, {}, std::move(share)});
  for (const int handle : o.handles) fresh.columns.push_back(&track.column(handle));
  return fresh;
}

void TelemetryHub::release(Feed& feed) {
  if (--feed.users > 0) return;
  feed.track->release(feed.handles);
  if (!feed.track->is_wanted()) tracks_.erase(feed.rhythm);
  feeds_.remove_if([&](const Feed& known) { return &known == &feed; });
}

void TelemetryHub::remove(const SubscriptionPtr& subscription) {
  Guard guard(mutex_);
  if (std::erase(subscriptions_, subscription) == 0) return;
  std::erase(blockers_, subscription);
  std::erase(decimators_, subscription);
  if (std::exchange(subscription->hungry, false)) --hungry_;
  drop_what_is_late(*subscription);
  release(*std::exchange(subscription->feed, nullptr));
  subscription->kept.clear();
  subscription->share = MemoryShare();
  some_.store(!subscriptions_.empty());
  look_for_blocks();
  room_.notify_all();
}

void TelemetryHub::close() {
  Guard guard(mutex_);
  if (std::exchange(closed_, true)) return;
  room_.notify_all();
  schedule();
  timer_.after(kLastRead, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->end_late_readers();
  });
}

// Who has not read what was kept when the simulation ended holds its stream no longer.
void TelemetryHub::end_late_readers() {
  Guard guard(mutex_);
  for (const SubscriptionPtr& s : subscriptions_) stall(*s);
  schedule();
}

void TelemetryHub::stall(Subscription& s) {
  s.stalled = true;
  if (!std::exchange(s.hungry, true)) ++hungry_;  // it is woken to be ended
}

TelemetryHub::Work TelemetryHub::work() const {
  Guard guard(mutex_);
  return work_;
}

// ------------------------------------------------------------------ the session's thread

bool TelemetryHub::is_due(const Rhythm& rhythm, std::int64_t step, Rhythmic& of) {
  if (step % rhythm.every != 0) return false;
  if (rhythm.interval == rhythm.interval.zero()) return true;
  const Clock::time_point now = Clock::now();
  if (now < of.due) return false;
  of.due = now + rhythm.interval;
  return true;
}

void TelemetryHub::publish(const Simulation& simulation) {
  Guard guard(mutex_);
  if (closed_) return;
  for (auto& [rhythm, rhythmic] : tracks_) {
    if (!is_due(rhythm, simulation.step_number(), rhythmic)) continue;
    Track& track = rhythmic.track;
    work_.evaluations += track.record(simulation);
    for (const SubscriptionPtr& s : decimators_)
      if (s->feed->track == &track) keep_for(*s);
    if (track.end() % kLookForLate == 0)
      for (const SubscriptionPtr& s : subscriptions_)
        if (s->feed->track == &track) drop_what_is_late(*s);
    news_ = true;
  }
  if (!blockers_.empty()) look_for_blocks();
  if (news_ && hungry_ > 0) schedule();
}

void TelemetryHub::look_for_blocks() {
  bool blocked = false;
  for (const SubscriptionPtr& s : blockers_) {
    const bool full =
        !s->stalled && !closed_ && s->feed->track->end() - s->next > s->options.capacity;
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
    stall(*s);
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
    if (const auto self = weak.lock()) self->wake_hungry();
  });
}

void TelemetryHub::wake_hungry() {
  std::vector<SubscriptionPtr> hungry;
  {
    Guard guard(mutex_);
    news_ = false;
    for (const SubscriptionPtr& s : subscriptions_)
      if (std::exchange(s->hungry, false)) hungry.push_back(s);
    hungry_ = 0;
    work_.wakes += static_cast<std::int64_t>(hungry.size());
  }
  for (const SubscriptionPtr& s : hungry) s->options.wake();
  timer_.after(kRound, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->rest();
  });
}

// The next round comes at once when there was news meanwhile.
void TelemetryHub::rest() {
  Guard guard(mutex_);
  scheduled_ = false;
  if ((news_ || closed_) && hungry_ > 0) schedule();
}

// ------------------------------------------------------------------ a subscriber

TelemetryHub::Taken TelemetryHub::take(Subscription& s, std::size_t most_bytes,
                                       std::string* batch) {
  Guard guard(mutex_);
  if (!s.feed) return Taken::closed;
  if (s.stalled) return Taken::stalled;
  const bool thinned = s.options.policy == v1::OVERFLOW_POLICY_DECIMATE;
  drop_what_is_late(s);
  if (thinned ? s.kept.empty() : s.next >= s.feed->track->end()) {
    if (closed_) return Taken::closed;
    if (!std::exchange(s.hungry, true)) ++hungry_;
    return Taken::nothing;
  }
  v1::SubscribeReply rest;
  s.total_dropped += s.dropped;
  rest.set_dropped(std::exchange(s.dropped, 0));
  rest.set_total_dropped(s.total_dropped);
  rest.set_every(s.options.rhythm.every * s.stride);
  batch->clear();
  {
    google::protobuf::io::StringOutputStream stream(batch);
    google::protobuf::io::CodedOutputStream out(&stream);
    const auto room = [&] { return static_cast<std::size_t>(out.ByteCount()) < most_bytes; };
    for (; !s.kept.empty() && room(); s.kept.pop_front())
      append(s.kept.front().sample, s.kept.front().sequence, out);
    for (; !thinned && s.next < s.feed->track->end() && room(); ++s.next)
      append(sample(*s.feed, s.next), ++s.sequence, out);
    rest.SerializeToCodedStream(&out);
  }
  if (s.blocks_since != Clock::time_point()) {
    look_for_blocks();
    room_.notify_all();
  }
  return Taken::samples;
}

bool TelemetryHub::is_stalled(const Subscription& subscription) const {
  Guard guard(mutex_);
  return subscription.stalled;
}

// The newest are kept for equal subscriptions, whose readers follow each other closely.
const std::string& TelemetryHub::sample(Feed& feed, std::int64_t number) {
  if (number < feed.first) return serialize(feed, number, late_);
  if (number > feed.end()) {
    feed.serialized.clear();
    feed.bytes = 0;
    feed.first = number;
  }
  while (feed.end() <= number) {
    std::string bytes;
    serialize(feed, feed.end(), bytes);
    feed.bytes += bytes.size();
    feed.serialized.push_back(std::move(bytes));
    for (; feed.bytes > kSerialized && feed.serialized.size() > 1; ++feed.first) {
      feed.bytes -= feed.serialized.front().size();
      feed.serialized.pop_front();
    }
  }
  return feed.serialized[static_cast<std::size_t>(number - feed.first)];
}

const std::string& TelemetryHub::serialize(const Feed& feed, std::int64_t number,
                                           std::string& bytes) {
  scratch_.Clear();
  scratch_.set_step(feed.track->step(number));
  scratch_.set_time(feed.track->time(number));
  for (const Track::Column* column : feed.columns) {
    const std::span<const double> values = feed.track->values(*column, number);
    scratch_.mutable_values()->Add(values.begin(), values.end());
  }
  scratch_.SerializeToString(&bytes);
  ++work_.serializations;
  return bytes;
}

void TelemetryHub::count_dropped(Subscription& s, std::int64_t count) {
  s.dropped += count;
  if (metrics_) metrics_->count_dropped_samples(count);
}

void TelemetryHub::drop_what_is_late(Subscription& s) {
  if (s.options.policy != v1::OVERFLOW_POLICY_DROP_OLDEST) return;
  const std::int64_t late = s.feed->track->end() - s.options.capacity - s.next;
  if (late <= 0) return;
  s.next += late;
  s.sequence += late;
  count_dropped(s, late);
}

// The newest sample, if it is one of those that the subscription still takes.
void TelemetryHub::keep_for(Subscription& s) {
  const std::int64_t newest = s.feed->track->end() - 1;
  if ((newest - s.first) % s.stride != 0) return;
  if (static_cast<std::int64_t>(s.kept.size()) >= s.options.capacity) decimate(s);
  s.kept.push_back({sample(*s.feed, newest), ++s.sequence});
}

// Every other sample goes; a buffer for one cannot be halved.
void TelemetryHub::decimate(Subscription& s) {
  std::deque<Subscription::Kept> rest;
  for (std::size_t i = 0; i < s.kept.size(); i += 2) rest.push_back(std::move(s.kept[i]));
  if (static_cast<std::int64_t>(rest.size()) >= s.options.capacity) rest.pop_front();
  count_dropped(s, static_cast<std::int64_t>(s.kept.size() - rest.size()));
  s.kept = std::move(rest);
  s.stride *= 2;
}

}  // namespace mbcosim::server
