/// Methods that make simulations, or only look at a deck.

#include <algorithm>
#include <optional>

#include "service/display_name.h"
#include "service/durability.h"
#include "service/durations.h"
#include "service/protocol.h"
#include "service/simulations_service.h"
#include "service/upload.h"
#include "wire/convert.h"

namespace mbcosim::server {
namespace {

Session::Identity make_identity(std::string name, const v1::CreateOptions& options,
                                std::uint64_t digest, const Caller& caller,
                                const ServiceLimits& limits) {
  check_display_name(options.display_name());
  Session::Identity identity;
  identity.id = std::move(name);
  identity.display_name = options.display_name();
  identity.owner = caller.identity;
  identity.request_id = options.request_id();
  identity.request_digest = digest;
  identity.lease = limits.lease;
  identity.created = next_instant();
  if (options.has_lease()) {
    const std::chrono::milliseconds lease = milliseconds_of(options.lease(), "lease");
    if (lease <= std::chrono::milliseconds(0))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`lease` must be positive");
    if (lease > identity.lease)
      throw limit_refusal("lease_seconds", limits.lease.count(),
                          "the lease is longer than allowed");
    identity.lease = lease;
  }
  return identity;
}

/// A simulation at its initial solution, or wherever it was branched off.
struct Made {
  std::unique_ptr<Simulation> simulation;
  std::unique_ptr<DeckSockets> deck_sockets = nullptr;  ///< go before it does
};

/// A simulation whose creator vanished before it learned the name: nobody would ever delete it. So
/// what the call has made goes with the call, and half an upload leaves nothing behind; only what a
/// repeat of the request was given stays.
class Fresh {
 public:
  explicit Fresh(const Parts& parts) : parts_(parts) {}

  /// `make` makes the simulation, counted as the new session's, and fills its origin, and `deck`
  /// for one that is durable; else that is null. `digest`: of the request.
  template <class Make>
  SessionPtr add(const v1::CreateOptions& options, std::uint64_t digest, Exchange& exchange,
                 const KeptDeck* deck, Make make, const std::string& forked_from = "")
      TS_EXCLUDES(mutex_) {
    const CallToken token(exchange.call());
    MemoryShare share;
    auto session = within(exchange.memory(), &token, &share, [&] {
      auto identity = make_identity(parts_.durability.new_name(), options, digest,
                                    exchange.caller(), parts_.config.limits);
      std::unique_ptr<SessionResults> results;
      if (options.has_results())
        results = std::make_unique<SessionResults>(parts_.results, identity.id, options.results(),
                                                   parts_.config.limits.results_bytes);
      Session::Origin origin;
      Made made = make(token, results.get(), &origin);
      return std::make_shared<Session>(std::move(identity), std::move(origin),
                                       std::move(made.simulation), parts_.shared(exchange.memory()),
                                       options, std::move(results), std::move(made.deck_sockets));
    });
    session->set_memory(std::move(share));
    if (deck) keep(*session, *deck, options);
    Guard guard(mutex_);
    if (lost_) {
      if (deck) parts_.durability.drop(*session);
      session->discard_results();
      throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
    }
    parts_.store.add(session);
    parts_.metrics.count_created();
    parts_.log.created(session->subject(), options.display_name(), forked_from);
    name_ = session->identity().id;
    return session;
  }
  /// The call has ended, and its client may not know the name.
  void lose(const std::string& owner) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    lost_ = true;
    if (name_.empty()) return;
    parts_.runtime.lanes.post(Lane::quick, owner,
                              [&store = parts_.store, name = name_] { store.discard(name); });
  }

 private:
  void keep(Session& session, const KeptDeck& deck, const v1::CreateOptions& options) {
    try {
      parts_.durability.begin(session, deck, options);
    } catch (...) {
      session.discard_results();
      throw;
    }
  }

  const Parts& parts_;
  Mutex mutex_;
  std::string name_ TS_GUARDED_BY(mutex_);
  bool lost_ TS_GUARDED_BY(mutex_) = false;
};

/// LAPACK cannot be stopped: the deck's own eigenanalyses are written only of what it does quickly.
void check_eigenanalyses(const Model& model) {
  constexpr int kMost = 300;
  const std::optional<EigenSettings>& settings = model.initial_value.eigenanalysis;
  if (settings && settings->is_dense() && model.unknowns > kMost)
    throw limit_refusal("eigenanalysis_unknowns", kMost,
                        "an `eigenanalysis` of the deck is too large for a dense solver: write "
                        "`use arpack, <number>, <basis>, <tolerance>`");
}

/// The model of a deck at its initial solution, with the codes at its sockets where the options ask
/// for them.
Made initial_solution(const Session::Origin& origin, const v1::CreateOptions& options,
                      SessionResults* results, DeckSocketFolder& folder, int threads,
                      const CancelToken& token) {
  if (results) check_eigenanalyses(*origin.model);
  Made made{Simulation::prepare(origin.model, results ? results->start(*origin.model) : nullptr,
                                origin.time_keeping)};
  made.simulation->set_threads(threads);
  if (options.has_deck_sockets()) {
    if (options.record_ports())
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`record_ports` keeps nothing of what crosses the deck's sockets");
    made.deck_sockets = folder.open(*made.simulation, options.deck_sockets(), token);
  }
  const Status started =
      made.deck_sockets ? made.deck_sockets->start(token) : made.simulation->start(&token);
  if (!started) throw Refusal(results ? results->without_paths(started.error()) : started.error());
  return made;
}

/// What an earlier process made for this request id is brought back, so that it is found.
void wake_known(const Parts& parts, const v1::CreateOptions& options, Exchange& exchange) {
  const Caller& caller = exchange.caller();
  const std::string name = parts.durability.find_request(caller.identity, options.request_id());
  if (!name.empty()) (void)parts.store.get(name, caller, exchange.call(), Access::own);
}

[[noreturn]] void refuse_empty_upload() {
  throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an upload must be `header`");
}

// ------------------------------------------------------------------ CreateSimulation

/// What CreateSimulation and its form in one message share.
class Creation {
 public:
  explicit Creation(const Parts& parts) : parts_(parts), fresh_(parts) {}

  /// Where the caller's deck arrives.
  DeckUpload& upload(Exchange& exchange) {
    if (!upload_) upload_.emplace(parts_.config.limits, exchange.memory());
    return *upload_;
  }
  template <class Reply>
  Reply run(Exchange& exchange) {
    if (!upload_) refuse_empty_upload();
    const v1::CreateOptions& options = upload_->header().options();
    Reply reply;
    fill_protocol(reply.mutable_protocol());
    wake_known(parts_, options, exchange);
    const std::uint64_t digest = options.request_id().empty() ? 0 : upload_->digest();
    const SessionStore::Place place(parts_.store, options.request_id(), digest, exchange.caller(),
                                    exchange.call());
    if (place.known())
      place.known()->fill(reply.mutable_simulation(), exchange.caller());
    else
      create(exchange, options, digest, &reply);
    return reply;
  }
  void lose(const std::string& owner) { fresh_.lose(owner); }

 private:
  template <class Reply>
  void create(Exchange& exchange, const v1::CreateOptions& options, std::uint64_t digest,
              Reply* reply) {
    Grants::check_known(options.grants(), parts_.runtime.authenticator);
    LoadedDeck report;
    KeptDeck deck;
    KeptDeck* const kept = parts_.durability.wanted(options, nullptr) ? &deck : nullptr;
    const auto make = [&](const CancelToken& token, SessionResults* results,
                          Session::Origin* origin) {
      report = load(*upload_, parts_.config, kept);
      if (!report.ok()) refuse_deck(report);
      *origin = {report.model,
                 std::move(report.symbols),
                 options.summed_time() ? TimeKeeping::summed : TimeKeeping::exact,
                 options.symbols(),
                 false,
                 std::move(report.files),
                 std::move(report.attached)};
      return initial_solution(*origin, options, results, parts_.deck_sockets, parts_.config.threads,
                              token);
    };
    fresh_.add(options, digest, exchange, kept, make)
        ->fill(reply->mutable_simulation(), exchange.caller());
    to_proto(report.diagnostics, reply->mutable_diagnostics());
    reply->set_printed(utf8(report.printed));
  }

  const Parts& parts_;
  std::optional<DeckUpload> upload_;
  Fresh fresh_;
};

class CreateHandler final : public Upload<v1::UploadRequest> {
 public:
  explicit CreateHandler(const Parts& parts) : creation_(parts) {}

 private:
  void add(Exchange& exchange, v1::UploadRequest& request, MemoryShare share) override {
    DeckUpload& upload = creation_.upload(exchange);
    upload.add(request, std::move(share));
    check_protocol(upload.header().options().protocol());
  }
  void complete(Exchange& exchange) override {
    exchange.end(serialized(creation_.run<v1::CreateSimulationReply>(exchange)));
  }
  void on_done(Exchange& exchange, bool delivered) override {
    if (!delivered) creation_.lose(exchange.caller().identity);
  }

  Creation creation_;
};

class CreateInlineHandler final : public OneRequest<v1::InlineUpload> {
 public:
  explicit CreateInlineHandler(const Parts& parts) : OneRequest(Lane::heavy), creation_(parts) {}

 private:
  void serve(Exchange& exchange, const v1::InlineUpload& request) override {
    check_protocol(request.header().options().protocol());
    creation_.upload(exchange).add(request);
    exchange.end(serialized(creation_.run<v1::CreateSimulationInlineReply>(exchange)));
  }
  void on_done(Exchange& exchange, bool delivered) override {
    if (!delivered) creation_.lose(exchange.caller().identity);
  }

  Creation creation_;
};

// ------------------------------------------------------------------ ValidateModel

/// What an observer may have read: enough to check a deck of its own, too little to keep the
/// daemon busy.
ServiceLimits limits_for(Role role, ServiceLimits limits) {
  constexpr std::int64_t kBytes = 256 << 10, kStatements = 100'000;
  if (role != Role::observe) return limits;
  limits.engine.deck_bytes = std::min(limits.engine.deck_bytes, kBytes);
  limits.engine.statements = std::min(limits.engine.statements, kStatements);
  return limits;
}

constexpr int kDescribed = 20000;  // nodes and elements: what fits into a message

void describe(const DeckReport& report, v1::ModelDescription* out) {
  const Model& model = *report.model;
  to_proto(model, out);
  const auto room = [&] { return out->nodes_size() + out->elements_size() < kDescribed; };
  for (int k = 0; k < node_count(model) && room(); ++k) to_proto(model, k, out->add_nodes());
  for (const ElementRef& e : model.elements) {
    if (!room()) break;
    to_proto(model, e, out->add_elements());
  }
  for (const DeckSymbol& symbol : report.symbols) to_proto(symbol, out->add_symbols());
}

template <class Reply>
Reply look_at(DeckUpload& upload, const Config& config, const Limits& limits, Exchange& exchange) {
  const CallToken token(exchange.call());
  MemoryShare share;
  return within(exchange.memory(), &token, &share, [&] {
    const DeckReport report = read_alone(upload, config, limits);
    Reply reply;
    reply.set_ok(report.ok());
    to_proto(report.diagnostics, reply.mutable_diagnostics());
    reply.set_printed(utf8(report.printed));
    if (report.ok()) describe(report, reply.mutable_description());
    return reply;
  });
}

class ValidateHandler final : public Upload<v1::UploadRequest> {
 public:
  explicit ValidateHandler(const Parts& parts) : parts_(parts) {}

 private:
  void add(Exchange& exchange, v1::UploadRequest& request, MemoryShare share) override {
    if (!upload_) {
      limits_ = limits_for(exchange.caller().role, parts_.config.limits);
      upload_.emplace(limits_, exchange.memory());
    }
    upload_->add(request, std::move(share));
  }
  void complete(Exchange& exchange) override {
    if (!upload_) refuse_empty_upload();
    exchange.end(serialized(
        look_at<v1::ValidateModelReply>(*upload_, parts_.config, limits_.engine, exchange)));
  }

  const Parts& parts_;
  ServiceLimits limits_;
  std::optional<DeckUpload> upload_;
};

class ValidateInlineHandler final : public OneRequest<v1::InlineUpload> {
 public:
  explicit ValidateInlineHandler(const Parts& parts) : OneRequest(Lane::heavy), parts_(parts) {}

 private:
  void serve(Exchange& exchange, const v1::InlineUpload& request) override {
    const ServiceLimits limits = limits_for(exchange.caller().role, parts_.config.limits);
    DeckUpload upload(limits, exchange.memory());
    upload.add(request);
    exchange.end(serialized(
        look_at<v1::ValidateModelInlineReply>(upload, parts_.config, limits.engine, exchange)));
  }

  const Parts& parts_;
};

// ------------------------------------------------------------------ ForkSimulation

/// A fork, with result files of its own.
std::unique_ptr<Simulation> branch(Session& source, int snapshot, SessionResults* results,
                                   const Call& call, const CancelToken& cancel) {
  std::unique_ptr<Simulation> simulation = source.fork(snapshot, call, cancel);
  if (!results) return simulation;
  const Status begun = simulation->write_to(results->start(simulation->model()));
  if (!begun) throw Refusal(results->without_paths(begun.error()));
  return simulation;
}

class ForkHandler final : public OneRequest<v1::ForkSimulationRequest> {
 public:
  explicit ForkHandler(const Parts& parts)
      : OneRequest(Lane::heavy), parts_(parts), fresh_(parts) {}

 private:
  void serve(Exchange& exchange, const v1::ForkSimulationRequest& request) override {
    const v1::CreateOptions& options = request.options();
    check_protocol(options.protocol());
    v1::ForkSimulationReply reply;
    fill_protocol(reply.mutable_protocol());
    wake_known(parts_, options, exchange);
    const std::uint64_t digest = digest_of("ForkSimulation", request);
    const SessionStore::Place place(parts_.store, options.request_id(), digest, exchange.caller(),
                                    exchange.call());
    const SessionPtr forked = place.known() ? place.known() : fork(exchange, request, digest);
    forked->fill(reply.mutable_simulation(), exchange.caller());
    exchange.end(serialized(reply));
  }
  void on_done(Exchange& exchange, bool delivered) override {
    if (!delivered) fresh_.lose(exchange.caller().identity);
  }

  SessionPtr fork(Exchange& exchange, const v1::ForkSimulationRequest& request,
                  std::uint64_t digest) {
    const SessionHold source(parts_.store, request.simulation(), exchange.caller(), exchange.call(),
                             Access::control);
    if (request.options().symbols_size() > 0)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`symbols` cannot change the model of a fork");
    if (request.options().has_deck_sockets())
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`deck_sockets`: the codes of the deck are with the simulation that is forked");
    if (request.options().has_units())
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`units` of a fork are those of its original");
    Grants::check_known(request.options().grants(), parts_.runtime.authenticator);
    const int number = request.has_snapshot() ? snapshot_in(request) : -1;
    KeptDeck deck;
    const bool durable = parts_.durability.wanted(request.options(), &*source);
    if (durable) deck = parts_.durability.deck_of(*source);
    const auto make = [&](const CancelToken& token, SessionResults* results,
                          Session::Origin* origin) {
      *origin = source->origin();
      origin->forked = true;
      return Made{branch(*source, number, results, exchange.call(), token)};
    };
    return fresh_.add(request.options(), digest, exchange, durable ? &deck : nullptr, make,
                      request.simulation());
  }

  const Parts& parts_;
  Fresh fresh_;
};

}  // namespace

void add_creation(Gate& gate, const Parts& parts) {
  gate.add(simulations_path("CreateSimulation"),
           stream(Role::control, [&parts] { return std::make_unique<CreateHandler>(parts); }));
  gate.add(simulations_path("ValidateModel"),
           stream(Role::observe, [&parts] { return std::make_unique<ValidateHandler>(parts); }));
  gate.add(simulations_path("CreateSimulationInline"),
           {Role::control, false, Counted::call,
            [&parts] { return std::make_unique<CreateInlineHandler>(parts); }});
  gate.add(simulations_path("ValidateModelInline"),
           {Role::observe, false, Counted::call,
            [&parts] { return std::make_unique<ValidateInlineHandler>(parts); }});
  gate.add(simulations_path("ForkSimulation"), {Role::control, false, Counted::call, [&parts] {
                                                  return std::make_unique<ForkHandler>(parts);
                                                }});
}

}  // namespace mbcosim::server
