#include "service/journal_turn.h"

#include "service/snapshot_shelf.h"

namespace mbcosim::server {

void JournalTurn::begin(const Simulation& simulation) {
  if (!parts_.storage.has_journal()) return;
  share_ = MemoryShare(parts_.memory, size_of(simulation.state()));
  remember(simulation);
}

void JournalTurn::remember(const Simulation& simulation) {
  before_ = simulation.state();
  finished_before_ = simulation.finished();
  told_before_ = account_.reply();
}

void JournalTurn::settle(Simulation& simulation, bool whole) {
  if (!parts_.storage.has_journal() || !unsettled_) return;
  std::optional<v1::KeptReply> reply;
  if (turn_.has_id()) reply = turn_.described(account_.reply(), !whole);
  try {
    parts_.storage.store(simulation, reply);
  } catch (...) {
    go_back(simulation);
    throw;
  }
  unsettled_ = false;
  parts_.status.publish(simulation);
  if (!whole) remember(simulation);
}

void JournalTurn::go_back(Simulation& simulation) {
  if (parts_.results) parts_.results->expect(before_->step);
  const Status back = simulation.restore(*before_, finished_before_);
  if (parts_.results) parts_.results->restored();
  account_.go_back(told_before_);
  unsettled_ = false;
  if (back) return parts_.status.publish(simulation);
  const Error told = parts_.results ? parts_.results->without_paths(back.error()) : back.error();
  parts_.news.broken(back.error().message,
                     "steps that are not stored cannot be taken back: " + told.message,
                     before_->step);
}

}  // namespace mbcosim::server
