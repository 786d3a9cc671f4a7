/// Durability: simulations that are on the disk only, and how they come there and back.
#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <functional>
#include <set>

#include "durable/build.h"
#include "service/display_name.h"
#include "service/durability.h"
#include "service/durations.h"
#include "service/event_log.h"
#include "service/storing.h"
#include "wire/convert.h"

namespace mbcosim::server {

bool Durability::may_see(const Suspended& suspended, const Caller& caller, Access access) const {
  return Rights(suspended.owner, suspended.info.grants()).allow(caller, access);
}

void Durability::check_readable(const std::string& simulation) const {
  const auto found = unreadable_.find(simulation);
  if (found != unreadable_.end())
    throw Refusal(v1::REASON_STORAGE_FULL,
                  simulation + " could not be read when the server began: " + found->second);
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
  std::multimap<std::chrono::steady_clock::time_point, std::pair<std::string, std::string>,
                std::greater<>>
      found;
  Guard guard(mutex_);
  for (const auto& [name, suspended] : suspended_)
    found.emplace(suspended.since, std::pair(name, suspended.owner));
  std::vector<std::pair<std::string, std::string>> result;
  for (auto& [since, simulation] : found) result.push_back(std::move(simulation));
  return result;
}

bool Durability::remove(const std::string& simulation, const Caller& caller, const Call& call,
                        const std::string& request_id) {
  std::optional<Grants> grants;
  {
    Guard guard(mutex_);
    check_readable(simulation);
    await_waking(simulation, call);
    const auto found = suspended_.find(simulation);
    if (found == suspended_.end() || !may_see(found->second, caller, Access::see)) return false;
    grants.emplace(found->second.owner, found->second.info.grants());
    grants->require(simulation, caller, Access::own);
    suspended_.erase(found);
    parts_->store.note_removal(simulation, {caller.identity, request_id});
  }
  store_removal(simulation, caller.identity, request_id);
  remove_files(simulation);
  parts_->results.remove(simulation);
  log_.deleted({simulation, *grants}, v1::DELETION_CAUSE_ASKED);
  return true;
}

std::string Durability::find_request(const std::string& owner,
                                     const std::string& request_id) const {
  Guard guard(mutex_);
  const auto* found = made_by(owner, request_id);
  return found ? found->first : "";
}

const std::pair<const std::string, Suspended>* Durability::made_by(
    const std::string& owner, const std::string& request_id) const {
  if (request_id.empty()) return nullptr;
  for (const auto& entry : suspended_)
    if (entry.second.owner == owner && entry.second.request_id == request_id) return &entry;
  return nullptr;
}

void Durability::expire() {
  const auto now = std::chrono::steady_clock::now();
  std::vector<std::pair<std::string, Suspended>> over;
  {
    Guard guard(mutex_);
    for (auto& [name, suspended] : suspended_)
      if (now - suspended.since > config_.suspended_expiry && waking_.count(name) == 0 &&
          !parts_->store.has(name))
        over.emplace_back(name, std::move(suspended));
    for (const auto& [name, suspended] : over) suspended_.erase(name);
  }
  for (const auto& [name, suspended] : over) {
    remove_files(name);
    parts_->results.remove(name);
    const Grants grants(suspended.owner, suspended.info.grants());
    log_.deleted({name, grants}, v1::DELETION_CAUSE_LEASE_OVER);
  }
}

// ------------------------------------------------------------------ from disk to memory

void Durability::await_waking(const std::string& simulation, const Call& call) {
  constexpr std::chrono::milliseconds kLook(20);
  while (waking_.count(simulation) > 0 && !call.cancelled()) {
    if (stop_) throw shutting_down();
    changed_.wait_for(mutex_, kLook);
  }
  if (call.cancelled()) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
}

// One at a time makes a session of it, others wait for that. True: it is in the store now.
bool Durability::wake(const std::string& simulation, const Caller& caller, Call& call) {
  std::string owner;
  {
    Guard guard(mutex_);
    check_readable(simulation);
    await_waking(simulation, call);
    const auto found = suspended_.find(simulation);
    if (found == suspended_.end()) return parts_->store.has(simulation);
    if (!may_see(found->second, caller, Access::see)) return false;
    owner = found->second.owner;
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
  const SessionStore::Place place(parts_->store, "", 0, {owner, Role::control}, call);
  const SessionPtr session = revive(simulation, owner, call);
  parts_->store.add(session);
  unsuspend(simulation);
  v1::SimulationInfo info;
  session->fill(&info);
  log_.state_changed(session->subject(), info.state(), info.step());
  return true;
}

namespace {

Session::Identity identity_of(const v1::CheckpointHead& head, const v1::SimulationInfo& info) {
  using google::protobuf::util::TimeUtil;
  Session::Identity identity;
  identity.id = head.simulation();
  identity.display_name = info.display_name();
  identity.owner = head.owner();
  identity.request_id = head.options().request_id();
  identity.request_digest = head.request_digest();
  identity.lease = std::chrono::milliseconds(TimeUtil::DurationToMilliseconds(info.lease()));
  identity.created = TimeUtil::TimestampToMicroseconds(info.create_time());
  return identity;
}

TimeKeeping time_keeping(const v1::CheckpointHead& head) {
  return head.options().summed_time() ? TimeKeeping::summed : TimeKeeping::exact;
}

/// The deck as it was stored. Throws OTHER_MODEL when this program makes another model of it, and
/// as `refuse_deck` when it makes none, by other limits, say.
LoadedDeck read_deck(StoredModel& model, const Config& config) {
  const v1::CheckpointHead& head = model.head;
  LoadedDeck deck = load({head.main_file(), std::move(model.files), head.model_options()}, config);
  if (!deck.ok()) refuse_deck(deck);
  if (digest_text(deck.model->digest) != head.model_digest())
    throw Refusal(v1::REASON_OTHER_MODEL, head.simulation() + " was stored by mbcosim " +
                                              head.program() +
                                              ", and this program reads its deck in another way");
  return deck;
}

void warn_of_another_build(const v1::CheckpointHead& head) {
  if (head.program() == MBCOSIM_VERSION && head.build() == this_build()) return;
  const auto told = [](const std::string& text) { return printable(text.substr(0, 100)); };
  spdlog::warn(
      "{} began with mbcosim {} ({}), this is {} ({}): from here on it need not have the bits that "
      "it would have had there",
      head.simulation(), told(head.program()),
      head.build().empty() ? "unknown build" : told(head.build()), MBCOSIM_VERSION, this_build());
}

}  // namespace

StoredBundle Durability::read_stored(const std::string& id) const {
  StoredBundle stored{folder_->read_model(id), read_latest(id), {}};
  for (const v1::CheckpointSnapshot& snapshot : stored.point.point.snapshots())
    stored.snapshots[snapshot.number()] = folder_->read_snapshot(id, snapshot.number());
  return stored;
}

SessionPtr Durability::revive(const std::string& simulation, const std::string& owner,
                              Call& call) try {
  const CallToken token(call);
  MemoryBudget& memory = parts_->runtime.budgets.of(owner);
  MemoryShare stored_share, share;
  StoredBundle stored =
      within(memory, &token, &stored_share, [&] { return read_stored(id_of(simulation)); });
  auto session = within(memory, &token, &share,
                        [&] { return session_of(stored.model, stored.point, memory); });
  session->set_memory(std::move(share));
  session->take_over(stored.point.point, stored.snapshots);
  session->set_keeping(make_keeping(simulation, stored.model.head.options()));
  {
    Guard guard(session->keeping()->mutex);
    for (const auto& [number, state] : stored.snapshots)
      session->keeping()->snapshots.insert(number);
    session->keeping()->done(session->changes(), session->step_number());
  }
  warn_of_another_build(stored.model.head);
  return session;
} catch (const DamagedFile& damage) {
  throw Refusal(v1::REASON_DAMAGED_STATE,
                simulation + " cannot be brought back: " + damage.what() +
                    "; `mbcosim resume --from-checkpoint` makes a simulation of what is whole in " +
                    id_of(simulation) + " of the state folder");
} catch (const StorageError& error) {
  refuse_storage(simulation + " cannot be brought back", error);
}

SessionPtr Durability::session_of(StoredModel& model, const StoredPoint& point,
                                  MemoryBudget& memory) {
  const v1::CheckpointHead& head = model.head;
  LoadedDeck deck = read_deck(model, config_);
  bool has_files = false;
  std::unique_ptr<SessionResults> results;
  if (head.options().has_results())
    results = std::make_unique<SessionResults>(parts_->results, head.simulation(),
                                               head.options().results(),
                                               config_.limits.results_bytes, &has_files);
  auto simulation = simulation_at(deck.model, time_keeping(head), point, results.get(), has_files);
  Session::Origin origin{deck.model,
                         std::move(deck.symbols),
                         time_keeping(head),
                         head.model_options().symbols(),
                         head.forked(),
                         std::move(deck.files),
                         std::move(deck.attached)};
  return std::make_shared<Session>(identity_of(head, point.point.info()), std::move(origin),
                                   std::move(simulation), parts_->shared(memory), head.options(),
                                   std::move(results));
}

std::unique_ptr<Simulation> Durability::simulation_at(const ModelPtr& model,
                                                      TimeKeeping time_keeping,
                                                      const StoredPoint& stored,
                                                      SessionResults* results, bool has_files) {
  auto simulation = Simulation::prepare(model, /*writer=*/nullptr, time_keeping);
  simulation->set_threads(config_.threads);
  if (const Status status = simulation->start(); !status) throw Refusal(status.error());
  if (const Status status = simulation->import_state(stored.state, stored.point.finished());
      !status)
    throw Refusal(status.error());
  if (!results) return simulation;
  const auto writer = results->start(*model);
  if (has_files && stored.point.has_results_until_step())
    results->expect(stored.point.results_until_step());
  const Status goes_on =
      has_files ? simulation->resume_writing(writer) : simulation->write_to(writer);
  if (!goes_on) throw Refusal(results->without_paths(goes_on.error()));
  return simulation;
}

// ------------------------------------------------------------------ from server to server

void Durability::require() const {
  if (!available())
    throw Refusal(v1::REASON_NOT_DURABLE,
                  "the server keeps no checkpoints: it was started without --state-dir");
}

namespace {

OpenFiles open_stored(const StateFolder& folder, const std::string& simulation) {
  try {
    return OpenFiles(folder.files_of(id_of(simulation)));
  } catch (const DamagedFile& damage) {
    throw Refusal(v1::REASON_DAMAGED_STATE, simulation + " cannot be read: " + damage.what());
  } catch (const StorageError& error) {
    refuse_storage(simulation + " cannot be read", error);
  }
}

}  // namespace

OpenFiles Durability::open_files(Session& session) try {
  Keeping* keeping = session.keeping();
  if (!keeping)
    throw Refusal(v1::REASON_NOT_DURABLE,
                  session.identity().id + " has durability NONE: its deck is not kept");
  Guard guard(keeping->mutex);
  write_held(session, *keeping);
  return open_stored(*folder_, session.identity().id);
} catch (const StorageError& error) {
  refuse_storage("the checkpoint cannot be written", error);
}

namespace {

void check_numbers(const v1::CheckpointPoint& point) {
  constexpr int kMost = 1 << 30;  // there are as many to come
  std::set<int> numbers;
  bool fine = point.next_snapshot() >= 0 && point.next_snapshot() <= kMost;
  for (const v1::CheckpointSnapshot& snapshot : point.snapshots()) {
    const int number = snapshot.number();
    fine = fine && number > 0 && number <= kMost && numbers.insert(number).second;
  }
  if (!fine)
    throw Refusal(v1::REASON_DAMAGED_STATE,
                  "the checkpoint's snapshots are not numbered as any server does");
}

/// Another server may allow longer ones.
void bound_lease(std::chrono::milliseconds longest, v1::CheckpointPoint* point) {
  google::protobuf::Duration* const lease = point->mutable_info()->mutable_lease();
  const std::chrono::milliseconds wanted = milliseconds_of(*lease, "lease");
  if (wanted <= std::chrono::milliseconds(0))
    throw Refusal(v1::REASON_DAMAGED_STATE, "the checkpoint's lease is not positive");
  *lease =
      google::protobuf::util::TimeUtil::MillisecondsToDuration(std::min(wanted, longest).count());
}

}  // namespace

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
  check_numbers(bundle.point.point);
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
  *point.mutable_info()->mutable_create_time() =
      google::protobuf::util::TimeUtil::MicrosecondsToTimestamp(next_instant());
  if (header.has_display_name()) point.mutable_info()->set_display_name(header.display_name());
  check_display_name(point.info().display_name());
  point.clear_kept_replies();        // of others' requests
  point.clear_results_until_step();  // its files begin here
  bound_lease(config_.limits.lease, &point);
  put_in_folder(name, bundle);
  describe(name, caller, &info);
  return info;
}

bool Durability::imported(const std::string& request_id, std::uint64_t digest, const Caller& caller,
                          v1::SimulationInfo* out) const {
  Guard guard(mutex_);
  const auto* found = made_by(caller.identity, request_id);
  if (!found) return false;
  if (found->second.request_digest != digest) refuse_other_request(request_id);
  *out = found->second.info;
  return true;
}

void Durability::put_in_folder(const std::string& simulation, const StoredBundle& bundle) {
  const std::string id = id_of(simulation);
  Suspended stored;
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
    stored = read_one(id);
  });
  add_suspended(id, std::move(stored));
  const Grants grants(bundle.model.head.owner(), bundle.point.point.info().grants());
  log_.created({simulation, grants}, bundle.point.point.info().display_name(), "");
}

}  // namespace mbcosim::server
