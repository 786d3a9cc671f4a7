#include "service/durability.h"

#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <optional>
#include <random>

#include "durable/build.h"
#include "service/protocol.h"
#include "service/storing.h"
#include "service/upload.h"
#include "threads/top_frame.h"
#include "wire/convert.h"

namespace mbcosim::server {
namespace {

std::unique_ptr<StateFolder> open_folder(const Config& config) {
  if (config.state_dir.empty()) return nullptr;
  return std::make_unique<StateFolder>(config.state_dir, config.limits.state_bytes);
}

}  // namespace

Durability::Durability(const Config& config, EventLog& log, Metrics& metrics)
    : config_(config),
      log_(log),
      metrics_(metrics),
      folder_(open_folder(config)),
      daemon_(config.daemon_id.empty() && folder_ ? folder_->name() : config.daemon_id) {
  if (folder_) read_folder();
}

std::int64_t Durability::bytes() const { return folder_ ? folder_->used() : 0; }

int Durability::suspended() const {
  Guard guard(mutex_);
  return static_cast<int>(suspended_.size());
}

Durability::~Durability() {
  {
    Guard guard(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Durability::start(const Parts& parts) {
  {
    Guard guard(mutex_);
    parts_ = &parts;
    for (auto& [name, suspended] : suspended_) suspended.share = share_of(suspended);
  }
  if (!folder_) return;
  {
    Guard guard(removing_);
    for (const StoredRemoval& removal : removals_)
      parts.store.note_removal(removal.simulation, {removal.identity, removal.request_id});
  }
  parts.store.set_keeper(
      {[this](const auto& name, const Caller& caller, Call& call) {
         return wake(name, caller, call);
       },
       [this](const auto& name, const Caller& caller, const Call& call, const auto& request_id) {
         return remove(name, caller, call, request_id);
       },
       [this](const auto& name, const auto& request) {
         store_removal(name, request.first, request.second);
       },
       [this](Session& session) { return suspend(session); },
       [this](const auto& name) { unsuspend(name); }, [this](Session& session) { forget(session); },
       [this](Session& session, CapturedPoint captured) { store(session, std::move(captured)); }});
  thread_ = std::thread([this] { loop(); });
}

void Durability::stop(bool busy) {
  {
    Guard guard(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (!thread_.joinable()) return;
  thread_.join();
  note_uses();
  for (const SessionPtr& session : parts_->store.all())
    if (session->keeping() && session->keeping()->stale(session->changes()) &&
        (!busy || session->is_free()))
      run_caught("the last checkpoint", [&] { write(*session); });
}

std::string Durability::new_name() const {
  std::random_device random;
  char text[20];
  std::snprintf(text, sizeof text, "%08x%08x", random(), random());
  return kSimulations + daemon_ + (daemon_.empty() ? "" : "-") + text;
}

// ------------------------------------------------------------------ what is in the folder

void Durability::read_folder() {
  read_removals();
  for (const std::string& id : folder_->list()) {
    try {
      read_simulation(id);
    } catch (const StorageError& error) {
      spdlog::error("state folder: {}; {} stays as it is until the daemon is started anew",
                    error.what(), id);
      Guard guard(mutex_);
      unreadable_[kSimulations + id] = error.what();
    }
  }
  Guard guard(mutex_);
  if (!suspended_.empty())
    spdlog::info("state folder: {} simulations are suspended", suspended_.size());
}

// Throws StorageError: it is there, and not damaged as far as that can be told, or must stay where
// it is.
void Durability::read_simulation(const std::string& id) {
  try {
    if (!folder_->is_unfinished(id)) return add_suspended(id, read_one(id));
    spdlog::info("state folder: {} was not yet made when the daemon ended; it is removed", id);
    folder_->remove(id);
  } catch (const DamagedFile& damage) {
    const std::string aside = named(damage.what(), [&] { return folder_->put_aside(id); });
    spdlog::error(
        "state folder: {}; put aside as {}: `mbcosim resume --from-checkpoint` makes a simulation "
        "of what is whole there",
        damage.what(), aside);
  }
}

// A deletion is noted before the simulation goes: of one that is still there nobody was told.
void Durability::read_removals() try {
  Guard guard(removing_);
  try {
    removals_ = folder_->read_removals();
  } catch (const DamagedFile& damage) {
    const std::string aside = named(damage.what(), [&] { return folder_->put_removals_aside(); });
    spdlog::error("state folder: {}; put aside as {}", damage.what(), aside);
  }
  for (const std::string& id : folder_->list())
    std::erase_if(removals_, [&](const StoredRemoval& removal) {
      return removal.simulation == kSimulations + id;
    });
} catch (const StorageError& error) {
  throw std::runtime_error("the state folder " + config_.state_dir +
                           " cannot be used: " + error.what());
}

Suspended Durability::read_one(const std::string& id) const {
  const v1::CheckpointHead head = folder_->read_head(id);
  if (head.simulation() != kSimulations + id)
    throw DamagedFile(id + "/model: it is of " + head.simulation());
  Suspended found;
  found.owner = head.owner();
  found.request_id = head.options().request_id();
  found.request_digest = head.request_digest();
  found.info = read_latest(id).point.info();
  constexpr std::int64_t kOld = 2'000'000'000;  // [s]
  const std::int64_t age =
      std::clamp<std::int64_t>(std::time(nullptr) - folder_->used_at(id), 0, kOld);
  found.since = std::chrono::steady_clock::now() - std::chrono::seconds(age);
  return found;
}

void Durability::add_suspended(const std::string& id, Suspended found) {
  Guard guard(mutex_);
  if (parts_) found.share = share_of(found);
  suspended_[kSimulations + id] = std::move(found);
}

// Of what is in the folder anyway: it is counted, and never refused.
MemoryShare Durability::share_of(const Suspended& suspended) const {
  constexpr std::int64_t kNode = 500;  // of the map, with its names
  MemoryShare share(parts_->runtime.budgets.of(suspended.owner));
  share.change(kNode + static_cast<std::int64_t>(suspended.info.SpaceUsedLong()));
  return share;
}

namespace {

void keep_replies(const v1::JournalEntry& entry, v1::CheckpointPoint* point) {
  for (const v1::KeptReply& reply : entry.kept_replies())
    KeptReplies::put_last(reply, point->mutable_kept_replies());
}

}  // namespace

// The last checkpoint, and what the journal tells of later.
StoredPoint Durability::read_latest(const std::string& id) const {
  StoredPoint latest = folder_->read_point(id);
  folder_->read_journals(id, [&](StoredEntry stored) {
    const v1::JournalEntry entry = message_of(stored);
    if (go_on(entry, std::move(stored.state), &latest)) keep_replies(entry, &latest.point);
  });
  return latest;
}

// ------------------------------------------------------------------ checkpoints

bool Durability::wanted(const v1::CreateOptions& options, const Session* original) const {
  const bool possible =
      available() && (!original || original->keeping()) && !options.has_deck_sockets();
  switch (options.durability()) {
    case v1::DURABILITY_UNSPECIFIED:
      return possible;
    case v1::DURABILITY_NONE:
      return false;
    case v1::DURABILITY_CHECKPOINT:
    case v1::DURABILITY_JOURNAL:
      if (possible) return true;
      if (options.has_deck_sockets())
        throw Refusal(v1::REASON_NOT_DURABLE,
                      "`durability`: the codes at the sockets that the deck names do not outlive "
                      "the server");
      throw Refusal(v1::REASON_NOT_DURABLE,
                    available() ? "the original of the fork has durability NONE: its deck is not "
                                  "kept"
                                : "the server keeps no checkpoints: it was started without "
                                  "--state-dir");
    default:
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`durability` is unknown to this server");
  }
}

void Durability::begin(Session& session, const KeptDeck& deck, const v1::CreateOptions& options) {
  const std::string id = id_of(session.identity().id);
  StoredModel model;
  model.head.set_simulation(session.identity().id);
  model.head.set_owner(session.identity().owner);
  model.head.set_program(MBCOSIM_VERSION);
  model.head.set_build(this_build());
  model.head.set_model_digest(digest_text(session.model().digest));
  model.head.set_main_file(deck.main_file);
  model.head.set_request_digest(session.identity().request_digest);
  model.head.set_forked(session.origin().forked);
  *model.head.mutable_options() = options;
  *model.head.mutable_model_options() = deck.options;
  model.files = deck.files;
  store_new(*folder_, id, [&] {
    session.set_keeping(make_keeping(session.identity().id, options));
    folder_->write_model(id, model);
    Keeping& keeping = *session.keeping();
    Guard guard(keeping.mutex);
    write_captured(session, keeping, session.capture());  // nobody knows of it yet
  });
}

std::unique_ptr<Keeping> Durability::make_keeping(const std::string& simulation,
                                                  const v1::CreateOptions& options) const {
  auto keeping = std::make_unique<Keeping>(options, config_.checkpoint_interval);
  if (options.durability() == v1::DURABILITY_JOURNAL)
    keeping->journal = std::make_unique<Journal>(*folder_, id_of(simulation));
  return keeping;
}

KeptDeck Durability::deck_of(const Session& session) const {
  try {
    StoredModel model = folder_->read_model(id_of(session.identity().id));
    return {model.head.main_file(), std::move(model.files), model.head.model_options()};
  } catch (const StorageError& error) {
    refuse_storage("the deck of the original cannot be read", error);
  }
}

MemoryBudget& Durability::memory_of(const Session& session) const {
  return parts_->runtime.budgets.of(session.identity().owner);
}

void Durability::write(Session& session) {
  Keeping& keeping = *session.keeping();
  Guard guard(keeping.mutex);
  write_held(session, keeping);
}

void Durability::store(Session& session, CapturedPoint captured) try {
  Keeping& keeping = *session.keeping();
  if (!keeping.over) write_and_tell(session, keeping, std::move(captured));
} catch (const StorageError& error) {
  session.note_change();  // should it be there all the same, the next checkpoint sets it right
  refuse_storage("what was asked cannot be stored", error);
}

void Durability::write_held(Session& session, Keeping& keeping) {
  if (!keeping.over) write_and_tell(session, keeping, session.capture());
}

void Durability::write_and_tell(Session& session, Keeping& keeping, CapturedPoint captured) {
  const std::int64_t step = captured.state.step;
  log_.checkpoint(session.subject(), step, write_captured(session, keeping, std::move(captured)));
}

std::int64_t Durability::write_captured(Session& session, Keeping& keeping,
                                        CapturedPoint captured) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string id = id_of(session.identity().id);
  const MemoryShare share(
      memory_of(session),
      2 * (size_of(captured.state) + static_cast<std::int64_t>(captured.point.ByteSizeLong())));
  const std::set<int> before = keeping.snapshots;
  std::string state;
  try {
    write_snapshots(session, keeping, id, captured.point);
    session.sync_results();
    state =
        captured.failed ? put_stored_state(id, captured.point) : session.bytes_of(captured.state);
    if (captured.reply)
      KeptReplies::put_last(*captured.reply, captured.point.mutable_kept_replies());
  } catch (...) {
    remove_snapshots_but(id, keeping, before);
    throw;
  }
  std::set<int> kept;
  for (const auto& snapshot : captured.point.snapshots()) kept.insert(snapshot.number());
  const auto bytes = static_cast<std::int64_t>(state.size() + captured.point.ByteSizeLong());
  try {
    folder_->write_point(id, {std::move(captured.point), std::move(state)});
  } catch (const NotSynced&) {
    keeping.doubted();
    throw;  // it may need the snapshots
  } catch (...) {
    remove_snapshots_but(id, keeping, before);
    throw;
  }
  remove_snapshots_but(id, keeping, kept);
  folder_->remove_journals(id, captured.journal_end);
  keeping.done(captured.changes, captured.state.step);
  metrics_.count_checkpoint(
      bytes, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  return bytes;
}

void Durability::remove_snapshots_but(const std::string& id, Keeping& keeping,
                                      const std::set<int>& kept) {
  for (auto number = keeping.snapshots.begin(); number != keeping.snapshots.end();) {
    if (kept.count(*number) == 0) {
      folder_->remove_snapshot(id, *number);
      number = keeping.snapshots.erase(number);
    } else {
      ++number;
    }
  }
}

// Of a simulation that has failed the last stored state stays. Its bytes.
std::string Durability::put_stored_state(const std::string& id, v1::CheckpointPoint& point) const {
  StoredPoint stored = read_latest(id);
  SessionStorage::take_stateless(point, &stored.point);
  point = std::move(stored.point);
  return std::move(stored.state);
}

// States of snapshots that have no file yet. One that was deleted meanwhile leaves the point.
void Durability::write_snapshots(Session& session, Keeping& keeping, const std::string& id,
                                 v1::CheckpointPoint& point) {
  google::protobuf::RepeatedPtrField<v1::CheckpointSnapshot> kept;
  for (const v1::CheckpointSnapshot& snapshot : point.snapshots()) {
    const int number = snapshot.number();
    if (keeping.snapshots.count(number) == 0) {
      const std::optional<State> state = session.snapshots().find_state(number);
      if (!state) continue;
      const MemoryShare share(memory_of(session), 2 * size_of(*state));
      keeping.snapshots.insert(number);  // the file may be there even when that throws
      folder_->write_snapshot(id, number, session.bytes_of(*state));
    }
    *kept.Add() = snapshot;
  }
  point.mutable_snapshots()->Swap(&kept);
}

void Durability::loop() {
  constexpr std::chrono::milliseconds kPeriod(20);
  Guard guard(mutex_);
  while (!stop_) {
    changed_.wait_for(mutex_, kPeriod);
    guard.unlock();
    run_caught("checkpoints", [this] { look(); });
    guard.lock();
  }
}

void Durability::note_uses() {
  for (const SessionPtr& session : parts_->store.all())
    if (session->keeping()) folder_->note_use(id_of(session->identity().id));
}

void Durability::look() {
  // What is used and does not change is known to be in use after a crash, too.
  if (Keeping::Clock::now() - uses_noted_ >
      std::chrono::milliseconds(config_.suspended_expiry) / 8) {
    uses_noted_ = Keeping::Clock::now();
    note_uses();
  }
  for (const SessionPtr& session : parts_->store.all()) {
    Keeping* keeping = session->keeping();
    if (keeping && !keeping->posted &&
        keeping->due(session->changes(), session->step_number(), Keeping::Clock::now()))
      post(session);
  }
  expire();
}

// A thread of its owner's takes the checkpoint: it waits for the end of a step, and with that
// perhaps for a peer, for which no other simulation waits.
void Durability::post(const SessionPtr& session) {
  const auto take = [this, session] {
    Keeping& keeping = *session->keeping();
    try {
      write(*session);
    } catch (const std::exception& error) {
      keeping.failed();
      log_.checkpoint_failed(session->subject(), error.what());
    }
    keeping.posted = false;
  };
  session->keeping()->posted = true;
  try {
    parts_->runtime.lanes.post(Lane::work, session->identity().owner, take);
  } catch (...) {
    session->keeping()->posted = false;
    throw;
  }
}

// ------------------------------------------------------------------ from memory to disk

bool Durability::suspend(Session& session) {
  try {
    if (session.keeping()->stale(session.changes())) write(session);
    const std::string id = id_of(session.identity().id);
    folder_->note_use(id);
    add_suspended(id, read_one(id));
    return true;
  } catch (const std::exception& error) {
    log_.checkpoint_failed(session.subject(), error.what());
    return false;
  }
}

void Durability::unsuspend(const std::string& simulation) {
  Guard guard(mutex_);
  suspended_.erase(simulation);
}

// On the disk when it returns. A disk that is full keeps nobody from deleting: the repeat of such a
// request is known until the daemon ends.
void Durability::store_removal(const std::string& simulation, const std::string& identity,
                               const std::string& request_id) {
  if (request_id.empty()) return;
  Guard guard(removing_);
  removals_.push_back({identity, request_id, simulation});
  if (removals_.size() > SessionStore::kRemovals) removals_.pop_front();
  try {
    folder_->write_removals(removals_);
  } catch (const StorageError& error) {
    spdlog::warn("state folder: the deletion of {} is not noted: {}", simulation, error.what());
  }
}

void Durability::forget(Session& session) {
  Guard guard(session.keeping()->mutex);  // no checkpoint is under way
  session.keeping()->over = true;
  remove_files(session.identity().id);
}

void Durability::remove_files(const std::string& simulation) {
  if (!folder_->remove(id_of(simulation)))
    spdlog::error(
        "state folder: {} is deleted, but its files cannot be removed: it is there again "
        "when the daemon is started anew",
        simulation);
}

}  // namespace mbcosim::server
