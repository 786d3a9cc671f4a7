#include "service/durability.h"

#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <optional>
#include <random>

#include "service/protocol.h"
#include "service/upload.h"
#include "threads/top_frame.h"
#include "wire/convert.h"

namespace mbcosim::server {
namespace {

const std::string kPrefix = "simulations/";

std::string id_of(const std::string& simulation) { return simulation.substr(kPrefix.size()); }

[[noreturn]] void refuse_storage(const std::string& what, const StorageError& error) {
  throw Refusal(v1::REASON_STORAGE_FULL, what + ": " + error.what());
}

// All of it, or nothing is left.
template <class Write>
void store_new(StateFolder& folder, const std::string& id, Write write) {
  try {
    write();
  } catch (const StorageError& error) {
    folder.remove(id);
    refuse_storage("the simulation cannot be stored", error);
  } catch (...) {
    folder.remove(id);
    throw;
  }
}

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
  parts_ = &parts;
  if (!folder_) return;
  parts.store.set_keeper(
      {[this](const auto& name, const Caller& caller, Call& call) {
         return wake(name, caller, call);
       },
       [this](const auto& name, const Caller& caller) { return remove(name, caller); },
       [this](Session& session) { return suspend(session); },
       [this](const auto& name) { unsuspend(name); }, [this](Session& session) { forget(session); },
       [this](Session& session) { store(session); }});
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
  for (const SessionPtr& session : parts_->store.all())
    if (session->keeping() && session->keeping()->stale(session->changes()) &&
        (!busy || session->is_free()))
      run_caught("the last checkpoint", [&] { write(*session); });
}

std::string Durability::new_name() const {
  std::random_device random;
  char text[20];
  std::snprintf(text, sizeof text, "%08x%08x", random(), random());
  return kPrefix + daemon_ + (daemon_.empty() ? "" : "-") + text;
}

// ------------------------------------------------------------------ what is in the folder

void Durability::read_folder() {
  for (const std::string& id : folder_->list()) {
    try {
      read_one(id);
    } catch (const StorageError& error) {
      spdlog::error("state folder: {}; put aside as {}", error.what(), folder_->put_aside(id));
    }
  }
  Guard guard(mutex_);
  if (!suspended_.empty())
    spdlog::info("state folder: {} simulations are suspended", suspended_.size());
}

void Durability::read_one(const std::string& id) {
  Suspended found;
  found.head = folder_->read_head(id);
  found.info = read_latest(id).point.info();
  found.since = folder_->written_at(id);
  if (found.head.simulation() != kPrefix + id)
    throw StorageError(id + "/model: it is of " + found.head.simulation());
  Guard guard(mutex_);
  suspended_[found.head.simulation()] = std::move(found);
}

namespace {

// What was kept later under the same id takes the place of what was kept before.
void keep_replies(const v1::JournalEntry& entry, v1::CheckpointPoint* point) {
  auto* kept = point->mutable_kept_replies();
  for (const v1::KeptReply& reply : entry.kept_replies()) {
    const auto same = std::remove_if(kept->begin(), kept->end(), [&](const v1::KeptReply& other) {
      return other.request_id() == reply.request_id() && other.identity() == reply.identity();
    });
    kept->erase(same, kept->end());
    *kept->Add() = reply;
  }
  const int over = kept->size() - static_cast<int>(KeptReplies::kReplies);
  if (over > 0) kept->DeleteSubrange(0, over);
}

}  // namespace

// The last checkpoint, and what the journal tells of later.
StoredPoint Durability::read_latest(const std::string& id) const {
  StoredPoint latest = folder_->read_point(id);
  v1::JournalEntry entry;
  folder_->read_journals(id, [&](StoredEntry stored) {
    if (!entry.ParseFromString(stored.message)) throw StorageError("an entry cannot be understood");
    if (entry.changes() <= latest.point.changes()) return;
    latest.point.set_changes(entry.changes());
    *latest.point.mutable_info() = entry.info();
    *latest.point.mutable_ports() = entry.ports();
    keep_replies(entry, &latest.point);
    latest.state = std::move(stored.state);
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
  model.head.set_model_digest(digest_text(session.model().digest));
  model.head.set_main_file(deck.main_file);
  model.head.set_request_digest(session.identity().request_digest);
  model.head.set_forked(session.origin().forked);
  *model.head.mutable_options() = options;
  *model.head.mutable_model_options() = deck.options;
  model.files = deck.files;
  session.set_keeping(make_keeping(session.identity().id, options));
  store_new(*folder_, id, [&] {
    folder_->write_model(id, model);
    write(session);
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

void Durability::store(Session& session) try { write(session); } catch (const StorageError& error) {
  refuse_storage("what was done is not stored yet", error);
}

void Durability::write(Session& session) {
  Keeping& keeping = *session.keeping();
  Guard guard(keeping.mutex);
  write_held(session, keeping);
}

void Durability::write_held(Session& session, Keeping& keeping) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string id = id_of(session.identity().id);
  if (keeping.over || session.has_failed()) return;
  CapturedPoint captured = session.capture();
  const MemoryShare share(memory_of(session), 2 * size_of(captured.state));
  write_snapshots(session, keeping, id, captured.point);
  session.sync_results();
  std::set<int> kept;
  for (const auto& snapshot : captured.point.snapshots()) kept.insert(snapshot.number());
  std::string state = session.bytes_of(captured.state);
  const auto bytes = static_cast<std::int64_t>(state.size() + captured.point.ByteSizeLong());
  folder_->write_point(id, {std::move(captured.point), std::move(state)});
  for (const int number : keeping.snapshots)
    if (kept.count(number) == 0) folder_->remove_snapshot(id, number);
  keeping.snapshots = std::move(kept);
  folder_->remove_journals(id, captured.journal_end);
  keeping.done(captured.changes, captured.state.step);
  metrics_.count_checkpoint(
      bytes, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
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
      folder_->write_snapshot(id, number, session.bytes_of(*state));
      keeping.snapshots.insert(number);
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

void Durability::look() {
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

void Durability::expire() {
  const std::int64_t now = std::time(nullptr), longest = config_.suspended_expiry.count();
  std::vector<std::pair<std::string, std::string>> over;
  {
    Guard guard(mutex_);
    for (const auto& [name, suspended] : suspended_)
      if (now - suspended.since > longest && waking_.count(name) == 0 && !parts_->store.has(name))
        over.emplace_back(name, suspended.head.owner());
    for (const auto& [name, owner] : over) suspended_.erase(name);
  }
  for (const auto& [name, owner] : over) {
    folder_->remove(id_of(name));
    parts_->results.remove(name);
    log_.deleted({name, owner}, v1::DELETION_CAUSE_LEASE_OVER);
  }
}

// ------------------------------------------------------------------ from memory to disk

bool Durability::suspend(Session& session) {
  try {
    if (session.keeping()->stale(session.changes())) write(session);
    read_one(id_of(session.identity().id));
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

void Durability::forget(Session& session) {
  Guard guard(session.keeping()->mutex);  // no checkpoint is under way
  session.keeping()->over = true;
  folder_->remove(id_of(session.identity().id));
}

// ------------------------------------------------------------------ from server to server

void Durability::require() const {
  if (!available())
    throw Refusal(v1::REASON_NOT_DURABLE,
                  "the server keeps no checkpoints: it was started without --state-dir");
}

OpenFiles Durability::open_files(Session& session) try {
  Keeping* keeping = session.keeping();
  if (!keeping)
    throw Refusal(v1::REASON_NOT_DURABLE,
                  session.identity().id + " has durability NONE: its deck is not kept");
  Guard guard(keeping->mutex);
  write_held(session, *keeping);
  return OpenFiles(folder_->files_of(id_of(session.identity().id)));
} catch (const StorageError& error) {
  refuse_storage("the checkpoint cannot be written", error);
}

v1::SimulationInfo Durability::import(StoredBundle bundle, const v1::ImportCheckpointHeader& header,
                                      std::uint64_t digest, const Caller& caller,
                                      const Call& call) {
  v1::SimulationInfo info;
  if (imported(header.request_id(), digest, caller, &info)) return info;
  const SessionStore::Place place(parts_->store, header.request_id(), digest, caller, call);
  if (imported(header.request_id(), digest, caller, &info)) return info;  // beside this call
  if (place.known()) {
    place.known()->fill(&info, caller);
    return info;
  }
  if (bundle.model.head.simulation().empty() || bundle.point.state.empty())
    throw Refusal(v1::REASON_DAMAGED_STATE, "the checkpoint has no model, or no state");
  v1::CheckpointHead& head = bundle.model.head;
  const std::string name = new_name();
  head.set_simulation(name);
  head.set_owner(caller.identity);
  head.set_request_digest(digest);
  head.mutable_options()->set_request_id(header.request_id());
  head.mutable_options()->clear_grants();
  v1::CheckpointPoint& point = bundle.point.point;
  point.mutable_info()->set_name(name);
  point.mutable_info()->set_owner(caller.identity);
  point.mutable_info()->clear_grants();
  if (header.has_display_name()) point.mutable_info()->set_display_name(header.display_name());
  point.clear_kept_replies();  // of others' requests
  const auto longest = google::protobuf::util::TimeUtil::SecondsToDuration(
      std::chrono::duration_cast<std::chrono::seconds>(config_.limits.lease).count());
  using google::protobuf::operator<;
  if (longest < point.info().lease()) *point.mutable_info()->mutable_lease() = longest;
  put_in_folder(name, bundle);
  describe(name, caller, &info);
  return info;
}

bool Durability::imported(const std::string& request_id, std::uint64_t digest, const Caller& caller,
                          v1::SimulationInfo* out) const {
  Guard guard(mutex_);
  const Suspended* found = made_by(caller.identity, request_id);
  if (!found) return false;
  if (found->head.request_digest() != digest) refuse_other_request(request_id);
  *out = found->info;
  return true;
}

void Durability::put_in_folder(const std::string& simulation, const StoredBundle& bundle) {
  const std::string id = id_of(simulation);
  store_new(*folder_, id, [&] {
    folder_->write_model(id, bundle.model);
    for (const v1::CheckpointSnapshot& snapshot : bundle.point.point.snapshots()) {
      const auto state = bundle.snapshots.find(snapshot.number());
      if (state == bundle.snapshots.end())
        throw Refusal(v1::REASON_DAMAGED_STATE, "the checkpoint lacks the state of snapshot " +
                                                    std::to_string(snapshot.number()));
      folder_->write_snapshot(id, snapshot.number(), state->second);
    }
    folder_->write_point(id, bundle.point);
    read_one(id);
  });
  log_.created({simulation, bundle.model.head.owner()}, bundle.point.point.info().display_name(),
               "");
}

// ------------------------------------------------------------------ suspended ones

bool Durability::may_see(const Suspended& suspended, const Caller& caller, Access access) const {
  return Grants(suspended.head.owner(), suspended.info.grants()).allow(caller, access);
}

bool Durability::knows(const std::string& simulation, const Caller& caller) const {
  Guard guard(mutex_);
  const auto found = suspended_.find(simulation);
  return found != suspended_.end() && may_see(found->second, caller, Access::see);
}

bool Durability::describe(const std::string& simulation, const Caller& caller,
                          v1::SimulationInfo* out) const {
  Guard guard(mutex_);
  const auto found = suspended_.find(simulation);
  if (found == suspended_.end() || !may_see(found->second, caller, Access::see)) return false;
  *out = found->second.info;
  if (!may_see(found->second, caller, Access::own)) out->clear_grants();
  return true;
}

std::vector<v1::SimulationInfo> Durability::list(const Caller& caller) const {
  std::vector<v1::SimulationInfo> found;
  Guard guard(mutex_);
  for (const auto& [name, suspended] : suspended_) {
    if (!may_see(suspended, caller, Access::see)) continue;
    found.push_back(suspended.info);
    if (!may_see(suspended, caller, Access::own)) found.back().clear_grants();
  }
  return found;
}

std::vector<std::pair<std::string, std::string>> Durability::by_last_use() const {
  std::multimap<std::int64_t, std::pair<std::string, std::string>, std::greater<>> found;
  Guard guard(mutex_);
  for (const auto& [name, suspended] : suspended_)
    found.emplace(suspended.since, std::pair(name, suspended.head.owner()));
  std::vector<std::pair<std::string, std::string>> result;
  for (auto& [since, simulation] : found) result.push_back(std::move(simulation));
  return result;
}

bool Durability::remove(const std::string& simulation, const Caller& caller) {
  std::string owner;
  {
    Guard guard(mutex_);
    const auto found = suspended_.find(simulation);
    if (found == suspended_.end() || waking_.count(simulation) > 0 ||
        !may_see(found->second, caller, Access::own))
      return false;
    owner = found->second.head.owner();
    suspended_.erase(found);
  }
  folder_->remove(id_of(simulation));
  parts_->results.remove(simulation);
  log_.deleted({simulation, owner}, v1::DELETION_CAUSE_ASKED);
  return true;
}

std::string Durability::find_request(const std::string& owner,
                                     const std::string& request_id) const {
  Guard guard(mutex_);
  const Suspended* found = made_by(owner, request_id);
  return found ? found->head.simulation() : "";
}

const Suspended* Durability::made_by(const std::string& owner,
                                     const std::string& request_id) const {
  if (request_id.empty()) return nullptr;
  for (const auto& [name, suspended] : suspended_)
    if (suspended.head.owner() == owner && suspended.head.options().request_id() == request_id)
      return &suspended;
  return nullptr;
}

// ------------------------------------------------------------------ from disk to memory

// One at a time makes a session of it, others wait for that. True: it is in the store now.
bool Durability::wake(const std::string& simulation, const Caller& caller, Call& call) {
  constexpr std::chrono::milliseconds kLook(20);
  Suspended suspended;
  {
    Guard guard(mutex_);
    while (waking_.count(simulation) > 0 && !stop_ && !call.cancelled())
      changed_.wait_for(mutex_, kLook);
    if (call.cancelled()) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
    const auto found = suspended_.find(simulation);
    if (found == suspended_.end()) return parts_->store.has(simulation);
    if (!may_see(found->second, caller, Access::see)) return false;
    suspended = found->second;
    waking_.insert(simulation);
  }
  struct Done {
    Durability& self;
    const std::string& name;
    ~Done() {
      Guard guard(self.mutex_);
      self.waking_.erase(name);
      self.changed_.notify_all();
    }
  } const done{*this, simulation};
  const SessionStore::Place place(parts_->store, "", 0, {suspended.head.owner(), Role::control},
                                  call);
  const SessionPtr session = revive(simulation, suspended, call);
  parts_->store.add(session);
  unsuspend(simulation);
  v1::SimulationInfo info;
  session->fill(&info);
  log_.state_changed(session->subject(), info.state(), info.step());
  return true;
}

SessionPtr Durability::revive(const std::string& simulation, const Suspended& suspended,
                              Call& call) try {
  const std::string id = id_of(simulation);
  StoredModel model = folder_->read_model(id);
  const StoredPoint point = read_latest(id);
  std::map<int, std::string> snapshots;
  for (const v1::CheckpointSnapshot& snapshot : point.point.snapshots())
    snapshots[snapshot.number()] = folder_->read_snapshot(id, snapshot.number());

  const v1::CreateOptions& options = model.head.options();
  MemoryShare share;
  MemoryBudget& memory = parts_->runtime.budgets.of(suspended.head.owner());
  const CallToken token(call);
  auto session = within(memory, &token, &share, [&] {
    LoadedDeck report =
        load({model.head.main_file(), std::move(model.files), model.head.model_options()}, config_);
    if (!report.ok() || digest_text(report.model->digest) != model.head.model_digest())
      throw Refusal(v1::REASON_OTHER_MODEL, simulation + " was stored by mbcosim " +
                                                model.head.program() +
                                                ", and this program reads its deck in another way");
    bool has_files = false;
    std::unique_ptr<SessionResults> results;
    if (options.has_results())
      results = std::make_unique<SessionResults>(parts_->results, simulation, options.results(),
                                                 config_.limits.results_bytes, &has_files);
    auto made = simulation_at(report.model, suspended, point.state, results.get(), has_files);
    Session::Identity identity{
        simulation,
        point.point.info().display_name(),
        suspended.head.owner(),
        options.request_id(),
        model.head.request_digest(),
        std::chrono::milliseconds(
            google::protobuf::util::TimeUtil::DurationToMilliseconds(point.point.info().lease()))};
    Session::Origin origin{report.model,
                           std::move(report.symbols),
                           options.summed_time() ? TimeKeeping::summed : TimeKeeping::exact,
                           model.head.model_options().symbols(),
                           model.head.forked(),
                           std::move(report.files),
                           std::move(report.attached)};
    return std::make_shared<Session>(std::move(identity), std::move(origin), std::move(made),
                                     parts_->shared(memory), options, std::move(results));
  });
  session->set_memory(std::move(share));
  session->take_over(point.point, snapshots);
  session->set_keeping(make_keeping(simulation, options));
  {
    Guard guard(session->keeping()->mutex);
    for (const auto& [number, state] : snapshots) session->keeping()->snapshots.insert(number);
    session->keeping()->done(session->changes(), session->step_number());
  }
  return session;
} catch (const StorageError& error) {
  throw Refusal(v1::REASON_DAMAGED_STATE, simulation + " cannot be brought back: " + error.what());
}

std::unique_ptr<Simulation> Durability::simulation_at(const ModelPtr& model,
                                                      const Suspended& suspended,
                                                      const std::string& state,
                                                      SessionResults* results, bool has_files) {
  auto simulation = Simulation::create(
      model, nullptr, nullptr,
      suspended.head.options().summed_time() ? TimeKeeping::summed : TimeKeeping::exact);
  if (!simulation) throw Refusal(simulation.error());
  if (const Status status = (*simulation)->import_state(state); !status)
    throw Refusal(status.error());
  if (!results) return std::move(*simulation);
  const auto writer = results->start(*model);
  const Status goes_on =
      has_files ? (*simulation)->resume_writing(writer) : (*simulation)->write_to(writer);
  if (!goes_on) throw Refusal(results->without_paths(goes_on.error()));
  return std::move(*simulation);
}

}  // namespace mbcosim::server
