/// Events as they come.
#include <google/protobuf/util/time_util.h>

#include "client/reading.h"
#include "mbcosim/v1/events.grpc.pb.h"

namespace mbcosim::client {

namespace {

/// Name of an enum's value without the prefix; one that is newer than this library: its number.
template <class Enum>
std::string word(const google::protobuf::EnumDescriptor* names, Enum value, std::size_t prefix) {
  const auto* found = names->FindValueByNumber(static_cast<int>(value));
  return found ? found->name().substr(prefix) : std::to_string(static_cast<int>(value));
}

Event::Peer to_peer(const v1::PeerEvent& from) {
  Event::Peer out{Event::Peer::unknown, from.port(), from.peer()};
  if (from.change() == v1::PEER_CHANGE_ATTACHED) out.change = Event::Peer::attached;
  if (from.change() == v1::PEER_CHANGE_LEFT) out.change = Event::Peer::left;
  if (from.change() == v1::PEER_CHANGE_LATE) out.change = Event::Peer::late;
  return out;
}

Event::Snapshot to_snapshot(const v1::SnapshotEvent& from) {
  Event::Snapshot out{Event::Snapshot::unknown, from.name(), from.step()};
  if (from.change() == v1::SNAPSHOT_CHANGE_SAVED) out.change = Event::Snapshot::saved;
  if (from.change() == v1::SNAPSHOT_CHANGE_RESTORED) out.change = Event::Snapshot::restored;
  if (from.change() == v1::SNAPSHOT_CHANGE_DELETED) out.change = Event::Snapshot::deleted;
  return out;
}

decltype(Event::content) to_content(const v1::Event& from) {
  using Case = v1::Event::ContentCase;
  switch (from.content_case()) {
    case Case::kMissed:
      return Event::Missed{from.missed().has_count() ? std::optional(from.missed().count())
                                                     : std::nullopt};
    case Case::kCreated:
      return Event::Created{from.created().display_name(), from.created().forked_from()};
    case Case::kDeleted:
      return Event::Deleted{from.deleted().cause() == v1::DELETION_CAUSE_LEASE_OVER};
    case Case::kStateChanged:
      return Event::StateChanged{
          word(v1::SimulationState_descriptor(), from.state_changed().state(),
               std::string("SIMULATION_STATE_").size()),
          from.state_changed().step()};
    case Case::kStepFailed:
      return Event::StepFailed{word(v1::StepOutcome_descriptor(), from.step_failed().outcome(),
                                    std::string("STEP_OUTCOME_").size()),
                               from.step_failed().failure().message(),
                               from.step_failed().failure().step()};
    case Case::kPeer:
      return to_peer(from.peer());
    case Case::kSnapshot:
      return to_snapshot(from.snapshot());
    case Case::kLeaseEnding:
      return Event::LeaseEnding{from.lease_ending().seconds_left()};
    case Case::kCheckpointFailed:
      return Event::CheckpointFailed{from.checkpoint_failed().message()};
    case Case::kCheckpoint:
      return Event::CheckpointWritten{from.checkpoint().step(), from.checkpoint().bytes()};
    default:
      return Event::Unknown{};
  }
}

}  // namespace

struct Events::Impl {
  Impl(std::shared_ptr<Server::Impl> connection, const v1::WatchEventsRequest& request)
      : stream(std::move(connection), request.simulation(),
               [&](v1::Events::Stub& stub, grpc::ClientContext* context) {
                 return stub.WatchEvents(context, request);
               }) {}

  Reading<v1::Events, v1::Event> stream;
  EventPlace place;
};

Events::Events(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Events::Events(Events&&) noexcept = default;
Events& Events::operator=(Events&&) noexcept = default;
Events::~Events() = default;
EventPlace Events::place() const { return impl_->place; }
void Events::close() { impl_->stream.cancel(); }

bool Events::next(Event& event) {
  v1::Event from;
  if (!impl_->stream.next(&from)) return false;
  event.sequence.reset();
  if (from.has_sequence()) impl_->place.last = event.sequence = from.sequence();
  const auto since = std::chrono::nanoseconds(
      google::protobuf::util::TimeUtil::TimestampToNanoseconds(from.time()));
  event.time = std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(since));
  event.simulation = from.simulation();
  event.identity = from.identity();
  event.method = from.method();
  event.trace_id = from.trace_id();
  event.content = to_content(from);
  return true;
}

Events Server::events(const std::string& simulation, const EventPlace& after, double timeout) {
  v1::WatchEventsRequest request;
  request.set_simulation(simulation);
  request.set_journal(after.journal);
  if (after.last) request.set_after_sequence(*after.last);
  auto impl = std::make_unique<Events::Impl>(impl_, request);
  v1::Event started;
  impl->stream.begin(&started, timeout, "the beginning of the events");
  impl->place = {started.started().journal(), after.last};
  return Events(std::move(impl));
}

}  // namespace mbcosim::client
