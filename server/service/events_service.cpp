#include "service/events_service.h"

#include <memory>
#include <string>
#include <utility>

#include "service/durability.h"

namespace mbcosim::server {
namespace {

using Reader = EventJournal::Reader;
using ReaderPtr = EventJournal::ReaderPtr;

/// Between events a watcher costs no thread. It does not hold the simulation: its lease may end.
class WatchHandler final : public OneRequest<v1::WatchEventsRequest> {
 public:
  explicit WatchHandler(const Parts& parts)
      : OneRequest(Lane::quick), parts_(parts), journal_(parts.log.journal()) {}

 private:
  void serve(Exchange& exchange, const v1::WatchEventsRequest& request) override {
    simulation_ = request.simulation();
    v1::SimulationInfo suspended;
    if (!simulation_.empty() &&
        !parts_.durability.describe(simulation_, exchange.caller(), &suspended))
      (void)parts_.store.get(simulation_, exchange.caller(), exchange.call(), Access::observe);
    ReaderPtr reader = std::make_shared<Reader>();
    reader->wants = [caller = exchange.caller(), name = simulation_](const v1::Event& event,
                                                                     const Rights& rights) {
      return name.empty() ? rights.allow(caller, Access::observe) : event.simulation() == name;
    };
    reader->wake = [weak = exchange.weak_from_this(), this] {
      if (const auto self = weak.lock())
        self->post(Lane::quick, [this, exchange = self.get()] { pump(*exchange); });
    };
    const bool anew = !request.journal().empty() && request.journal() != journal_.name();
    reader->next = anew ? 1 : first_wanted(request);
    {
      Guard guard(mutex_);
      if (over_) return;
      reader_ = reader;
      anew_ = anew;
    }
    journal_.enter(reader);
    v1::Event started;
    started.mutable_started()->set_journal(journal_.name());
    exchange.write(serialized(started));
  }
  std::int64_t first_wanted(const v1::WatchEventsRequest& request) const {
    if (!request.has_after_sequence()) return journal_.last() + 1;
    if (request.after_sequence() < 0)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`after_sequence` must not be negative");
    if (request.after_sequence() > journal_.last())
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`after_sequence` is larger than the last number of this journal, " +
                        std::to_string(journal_.last()));
    return request.after_sequence() + 1;
  }
  void on_written(Exchange& exchange) override {
    exchange.post(Lane::quick, [this, &exchange] { pump(exchange); });
  }
  // Sends what is next, unless the client has not taken the last.
  void pump(Exchange& exchange) {
    Guard guard(mutex_);
    if (!reader_ || !exchange.all_written()) return;
    if (std::exchange(anew_, false)) {
      event_.Clear();
      event_.mutable_missed();
    } else if (gone_) {
      return exchange.finish(grpc::Status::OK);
    } else {
      RightsPtr rights;
      if (!journal_.next(*reader_, &event_, &rights)) return;
      if (rights) rights->require(event_.simulation(), exchange.caller(), Access::observe);
    }
    gone_ = !simulation_.empty() && event_.has_deleted();
    exchange.write(serialized(event_));
  }
  void on_done(Exchange&, bool) override {
    ReaderPtr reader;
    {
      Guard guard(mutex_);
      over_ = true;
      reader = std::move(reader_);
    }
    if (reader) journal_.leave(reader);
  }

  const Parts& parts_;
  EventJournal& journal_;
  std::string simulation_;  ///< empty: all
  Mutex mutex_;
  ReaderPtr reader_ TS_GUARDED_BY(mutex_);
  v1::Event event_ TS_GUARDED_BY(mutex_);
  bool over_ TS_GUARDED_BY(mutex_) = false;
  bool anew_ TS_GUARDED_BY(mutex_) = false;  ///< the reader knows another journal
  bool gone_ TS_GUARDED_BY(mutex_) = false;  ///< its simulation is
};

}  // namespace

void add_events(Gate& gate, const Parts& parts) {
  gate.add("/mbcosim.v1.Events/WatchEvents",
           stream(Role::observe, [&parts] { return std::make_unique<WatchHandler>(parts); }));
}

}  // namespace mbcosim::server
