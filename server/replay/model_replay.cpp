#include "replay/model_replay.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "coupling/handshake.h"
#include "replay/record_file.h"
#include "rpc/workers.h"
#include "service/session.h"
#include "service/upload.h"
#include "wire/convert.h"

namespace mbcosim::replay {
namespace {

using server::Agreement;
using server::Port;
using server::Session;

/// What crossed one port, in order, and how far it was replayed.
struct PortRecord {
  std::vector<const v1::RecordEntry*> entries;
  std::size_t next = 0;

  const v1::RecordEntry* peek() const { return next < entries.size() ? entries[next] : nullptr; }
};

/// As a server of the record's time would have sent it: earlier ones did not tell the motion of
/// reference nodes.
v1::ServerMessage as_then(const v1::ServerMessage& recorded, v1::ServerMessage now) {
  if (!recorded.exchange().reference_position().empty() || !now.has_exchange()) return now;
  v1::ServerExchange* exchange = now.mutable_exchange();
  exchange->clear_reference_position();
  exchange->clear_reference_rotation();
  exchange->clear_reference_velocity();
  exchange->clear_reference_angular_velocity();
  exchange->clear_reference_acceleration();
  exchange->clear_reference_angular_acceleration();
  return now;
}

/// The recorded peer of one port.
class RecordedPeer : public server::PeerLink {
 public:
  RecordedPeer(Port& port, PortRecord& record, Outcome& outcome, double tolerance)
      : port_(port), record_(record), outcome_(outcome), tolerance_(tolerance) {}

  bool send(const v1::ServerMessage& now, std::chrono::steady_clock::time_point,
            const CancelToken&) override {
    skip_greetings();
    const v1::RecordEntry* expected = record_.peek();
    if (!expected || !expected->has_to_peer()) {
      note("a message that the record does not have");
      return true;
    }
    ++record_.next;
    if (const auto difference =
            first_difference(expected->to_peer(), as_then(expected->to_peer(), now), tolerance_))
      note(*difference);
    if (!now.has_exchange()) return true;
    ++outcome_.exchanges;
    answer();
    return true;
  }

 private:
  void skip_greetings() {
    while (record_.peek() &&
           (record_.peek()->from_peer().has_hello() || record_.peek()->to_peer().has_welcome() ||
            record_.peek()->detached() || !record_.peek()->lost().empty()))
      ++record_.next;
  }
  void answer() {
    const v1::RecordEntry* next = record_.peek();
    if (!next || !next->from_peer().has_exchange()) return;  // the peer did not answer then, either
    ++record_.next;
    v1::PeerExchange exchange = next->from_peer().exchange();
    try {
      port_.deliver(exchange);
    } catch (const server::Refusal& refusal) {
      note(std::string("the recorded answer is refused: ") + refusal.what());
    }
  }
  void note(const std::string& what) {
    if (outcome_.difference.empty())
      outcome_.difference = "step " + std::to_string(outcome_.steps) + ", port \"" +
                            port_.model().name() + "\": " + what;
  }

  Port& port_;
  PortRecord& record_;
  Outcome& outcome_;
  double tolerance_;
};

Session::Origin load_model(const std::string& deck, const v1::CreateOptions& options,
                           const v1::RecordHeader& header) {
  const std::filesystem::path path(deck);
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  const DeckReport report = read_deck(
      FolderSource(folder, /*unrestricted=*/true), path.filename().string(),
      {{}, server::attachments(options), server::symbols_of(options), server::units_of(options)});
  for (const Diagnostic& d : report.diagnostics)
    if (d.severity == Severity::error) throw std::runtime_error(d.text());
  const std::string digest = digest_text(report.model->digest);
  if (digest != header.model_digest())
    throw std::runtime_error("the deck has the digest " + digest + ", the record is of " +
                             header.model_digest());
  Session::Origin origin;
  origin.model = report.model;
  origin.time_keeping = options.summed_time() ? TimeKeeping::summed : TimeKeeping::exact;
  return origin;
}

std::unique_ptr<Simulation> start(const Session::Origin& origin, const v1::RecordHeader& header) {
  auto simulation =
      Simulation::create(origin.model, /*cancel=*/nullptr, /*writer=*/nullptr, origin.time_keeping);
  if (!simulation) throw std::runtime_error(simulation.error().message);
  if (!header.state().empty())
    if (const Status status = (*simulation)->import_state(header.state()); !status)
      throw std::runtime_error(status.error().message);
  return std::move(*simulation);
}

v1::CreateOptions options_of(const v1::RecordHeader& header) {
  v1::CreateOptions options;
  *options.mutable_ports() = header.ports();
  options.set_non_convergence_policy(header.non_convergence_policy());
  if (header.has_minimum_step_size()) options.set_minimum_step_size(header.minimum_step_size());
  *options.mutable_symbols() = header.symbols();
  if (header.has_units()) *options.mutable_units() = header.units();
  options.set_summed_time(header.summed_time());
  const auto& layouts = header.layouts();
  options.set_optional_ports(std::all_of(layouts.begin(), layouts.end(),
                                         [](const auto& port) { return port.optional(); }));
  return options;
}

/// The session of a record, without a daemon around it.
class ModelReplay {
 public:
  ModelReplay(const std::string& deck, const std::vector<v1::RecordEntry>& record, double tolerance)
      : record_(record),
        tolerance_(tolerance),
        slots_(1),
        origin_(load_model(deck, options_of(record.front().header()), record.front().header())),
        session_({}, origin_, start(origin_, record.front().header()),
                 {slots_, limits_, metrics_, log_, memory_, workers_.lanes, workers_.timer},
                 options_of(record.front().header())) {
    for (const v1::RecordEntry& entry : record)
      if (!entry.port().empty()) ports_[entry.port()].entries.push_back(&entry);
  }
  ~ModelReplay() {
    for (auto& [name, peer] : peers_) session_.port(name).detach();
  }

  Outcome run() {
    for (const v1::RecordEntry& entry : record_) {
      if (!outcome_.difference.empty() || !outcome_.end.empty()) break;
      if (entry.from_peer().has_hello())
        attach(entry);
      else if (entry.has_inputs())
        write(entry.inputs());
      else if (entry.has_chosen())
        chosen_ = entry.chosen();
      else if (entry.detached())
        leaving_.push_back(entry.port());
      else if (entry.has_accepted() || entry.has_failed())
        step(entry);
      else if (entry.has_restored())
        outcome_.end = "another state was restored";
      else if (entry.cut_off())
        outcome_.end = "the record met its limit";
    }
    return outcome_;
  }

 private:
  void attach(const v1::RecordEntry& entry) {
    leave();
    Port& port = session_.port(entry.port());
    v1::Hello hello = entry.from_peer().hello();
    hello.mutable_expected()->clear_step_size();
    hello.mutable_expected()->clear_step();
    Agreement agreement =
        server::agree(hello, port.model(), {digest_text(session_.model().digest)});
    agreement.timeout = std::chrono::milliseconds(20);  // who did not answer then does not now
    if (agreement.policy == v1::PEER_POLICY_WAIT) agreement.policy = v1::PEER_POLICY_FAIL_STEP;
    auto& peer = peers_[entry.port()];
    if (peer) port.detach();
    port.reserve(agreement);
    peer = std::make_unique<RecordedPeer>(port, ports_[entry.port()], outcome_, tolerance_);
    port.attach(peer.get(), {});
  }
  /// Peers left within the step before.
  void leave() {
    for (const std::string& name : leaving_)
      if (peers_.erase(name) > 0) session_.port(name).detach();
    leaving_.clear();
  }
  void write(const v1::Values& values) {
    v1::WriteVariablesRequest request;
    v1::WriteVariablesReply reply;
    *request.mutable_values() = values;
    const server::Call nobody;
    const server::KeptReplies::Turn turn(session_.kept(), server::Caller{}, "", 0, nobody);
    session_.write(request, nobody, turn, &reply);
  }
  void step(const v1::RecordEntry& entry) {
    const bool accepted = entry.has_accepted();
    const v1::StepNotice& notice = accepted ? entry.accepted() : entry.failed();
    ++outcome_.steps;
    const v1::StepRequest request = std::exchange(chosen_, {});
    v1::StepReply reply;
    server::Call nobody;
    session_.step(request, server::Caller{}, nobody, &reply);
    const v1::StepNotice now = server::step_notice(reply.step(), reply.time());
    const bool accepted_now = reply.steps_done() == 1;
    std::string difference;
    if (accepted != accepted_now)
      difference = accepted ? "accepted then, fails now: " + reply.failure().message()
                            : "failed then, is accepted now";
    else if (const auto found = first_difference(notice, now, tolerance_))
      difference = *found;
    if (!difference.empty() && outcome_.difference.empty())
      outcome_.difference = "step " + std::to_string(outcome_.steps) + ": " + difference;
    leave();
  }

  const std::vector<v1::RecordEntry>& record_;
  const double tolerance_;
  server::SolverSlots slots_;
  server::MemoryBudget memory_{server::MemoryBudget::default_bytes()};
  server::Workers workers_{1, 1};
  server::ServiceLimits limits_;
  server::Metrics metrics_;
  server::EventLog log_;
  const Session::Origin origin_;
  Session session_;
  std::map<std::string, PortRecord> ports_;
  std::map<std::string, std::unique_ptr<RecordedPeer>> peers_;
  std::vector<std::string> leaving_;
  v1::StepRequest chosen_;  ///< the next step
  Outcome outcome_;
};

}  // namespace

Outcome replay_model(const std::string& deck, const std::vector<v1::RecordEntry>& record,
                     double tolerance) {
  try {
    return ModelReplay(deck, record, tolerance).run();
  } catch (const server::Refusal& refusal) {
    throw std::runtime_error(refusal.what());
  }
}

}  // namespace mbcosim::replay
