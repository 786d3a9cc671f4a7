/// A step of a simulation with peers on ports, and with codes at the sockets that its deck names.
#pragma once

#include <functional>
#include <optional>

#include "coupling/coupler.h"
#include "service/deck_sockets.h"
#include "service/step_slot.h"

namespace mbcosim::server {

/// One step, in the order of the methods. `await_peers` and `exchange` wait for others and need no
/// lock; the other methods touch the simulation and need the session's.
class CoupledStep {
 public:
  /// Solves the step. Nothing: it was not solved.
  using Attempt = std::function<std::optional<StepReport>()>;

  /// `sockets`: null: the deck has none. All outlive this.
  CoupledStep(Coupler& coupler, DeckSockets* sockets, const CancelToken& token);

  void await_peers();  ///< throws PeerLost
  void prepare(const StepChoice& choice, const Simulation& simulation);
  void exchange();  ///< with explicit ports; throws PeerLost, PeerRejected
  /// Makes the attempt with what explicit ports gave; it exchanges with codes and tight ports at
  /// each iteration and is redone until window ports agree. Others compute without the slot.
  /// Nothing: as the attempt. Throws PeerLost, PeerRejected and what the attempt throws.
  std::optional<StepReport> solve(Simulation& simulation, StepSlot slot, const Attempt& attempt);
  /// How the step ended, also after an exception.
  void tell(bool accepted, const Simulation& simulation);

  /// For peers and codes so far [s].
  double waited_seconds() const;

 private:
  Coupler& coupler_;
  DeckSockets* const sockets_;
  const CancelToken& token_;
};

}  // namespace mbcosim::server
