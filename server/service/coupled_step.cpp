#include "service/coupled_step.h"

#include <utility>

#include "service/step_choice.h"
#include "wire/memory.h"

namespace mbcosim::server {
namespace {

/// While it lives, steps of the simulation exchange from within.
class ExchangeInStep {
 public:
  ExchangeInStep(Coupler& coupler, DeckSockets* sockets, Simulation& simulation, StepSlot& slot,
                 const CancelToken& token)
      : coupler_(coupler), sockets_(sockets), simulation_(simulation), slot_(slot), token_(token) {
    if (coupler_.has_tight() || sockets_)
      iterate();
    else if (coupler_.has_following())
      follow();
    if (coupler_.has_window()) repeat();
  }
  ~ExchangeInStep() {
    simulation_.set_exchange({});
    simulation_.set_attempt_ended({});
    simulation_.set_passes({});
  }
  ExchangeInStep(const ExchangeInStep&) = delete;
  ExchangeInStep& operator=(const ExchangeInStep&) = delete;

  /// A new step, or another attempt at it. Throws PeerLost.
  void begin() {
    if (sockets_)
      (void)wait([&] {
        sockets_->begin(token_);
        return true;
      });
  }

 private:
  void iterate() {
    simulation_.set_attempt_ended([this](bool accepted) {
      const MemoryPause uncounted;
      coupler_.end_attempt(accepted, simulation_, token_);
      if (sockets_) sockets_->attempt_failed();
    });
    simulation_.set_exchange([this](int iteration) {
      turn_loads();
      return wait([&] {
        const bool done = !sockets_ || sockets_->exchange(iteration, token_);
        return coupler_.exchange_iteration(simulation_, iteration, token_) && done;
      });
    });
  }
  void follow() {
    simulation_.set_exchange([this](int) {
      turn_loads();
      return true;
    });
  }
  void turn_loads() {
    const MemoryPause uncounted;
    coupler_.turn_loads(simulation_);
  }
  void repeat() {
    StepPasses passes;
    passes.most = coupler_.maximum_passes();
    passes.begin = [this](int pass) {
      const MemoryPause uncounted;
      if (pass == 1) coupler_.start_passes(simulation_, std::exchange(agreed_, false), token_);
      coupler_.apply_window(simulation_);
      if (pass > 1) coupler_.start_iterations(simulation_);
    };
    passes.agrees = [this](int pass) {
      return agreed_ = wait([&] { return coupler_.exchange_window(simulation_, pass, token_); });
    };
    simulation_.set_passes(std::move(passes));
  }
  /// Without the slot.
  template <class Exchange>
  bool wait(Exchange&& exchange) {
    const MemoryPause uncounted;
    slot_.give_up();
    const bool done = exchange();
    slot_.take();
    return done;
  }

  Coupler& coupler_;
  DeckSockets* const sockets_;
  Simulation& simulation_;
  StepSlot& slot_;
  const CancelToken& token_;
  bool agreed_ = false;  ///< the interfaces, in the last pass
};

}  // namespace

CoupledStep::CoupledStep(Coupler& coupler, DeckSockets* sockets, const CancelToken& token)
    : coupler_(coupler), sockets_(sockets), token_(token) {
  coupler_.start_clock();
  if (sockets_) sockets_->start_clock();
}

void CoupledStep::await_peers() { coupler_.await_peers(token_); }

void CoupledStep::prepare(const StepChoice& choice, const Simulation& simulation) {
  coupler_.prepare(simulation, length_of(choice, simulation), bool(choice.event));
}

void CoupledStep::exchange() { coupler_.exchange(token_); }

std::optional<StepReport> CoupledStep::solve(Simulation& simulation, StepSlot slot,
                                             const Attempt& attempt) {
  coupler_.apply(simulation);
  coupler_.start_iterations(simulation);
  ExchangeInStep exchange(coupler_, sockets_, simulation, slot, token_);
  exchange.begin();
  if (slot) {
    const double waited = waited_seconds();
    std::optional<StepReport> report = attempt();
    if (report) report->solver_seconds -= waited_seconds() - waited;
    return report;
  }
  StepReport report;
  report.outcome = StepOutcome::interrupted;
  return report;
}

void CoupledStep::tell(bool accepted, const Simulation& simulation) {
  coupler_.notify(accepted, simulation, token_);
  if (!accepted) return;
  coupler_.finish(simulation, token_);
  if (sockets_) sockets_->accepted(token_);
}

double CoupledStep::waited_seconds() const {
  return coupler_.waited_seconds() + (sockets_ ? sockets_->waited_seconds() : 0);
}

}  // namespace mbcosim::server
