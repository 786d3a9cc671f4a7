#include "mbdyn/force_dialogue.h"

#include "mbdyn/link.h"

namespace mbcosim::mbdyn {

ForceDialogue::ForceDialogue(const DeckChannel& channel, ForcePort port,
                             std::unique_ptr<ForceWire> wire)
    : timing_(channel.timing),
      name_(channel.card),
      port_(std::move(port)),
      wire_(std::move(wire)) {}

void ForceDialogue::send(const Simulation& simulation) {
  wire_->send(is_tight() ? kData : kLastData, port_.state(simulation));
  awaiting_ = timing_.listens;
}

void ForceDialogue::receive() {
  awaiting_ = false;
  ForceLoads loads;
  const Command command = wire_->receive(loads);
  if (command == kData || command == kLastData) loads_ = std::move(loads);
  if (command == kEnd) wants_end_ = true;
  done_ = command != kData;
}

void ForceDialogue::start(const Simulation& simulation) {
  if (!is_tight()) send(simulation);
}

void ForceDialogue::step_begins() { exchanged_ = done_ = false; }

// Tight codes iterate anew; the others have no way back, so that their answer stays.
void ForceDialogue::attempt_failed() { done_ = false; }

bool ForceDialogue::sends_at(int iteration, bool in_derivatives) const {
  if (done_ || wants_end_) return false;
  const int count = iteration + (timing_.send_after_predict && !in_derivatives ? 1 : 0);
  return count > 0 && count % timing_.every == 0;
}

bool ForceDialogue::exchange(Simulation& simulation, int iteration, bool in_derivatives) {
  if (is_tight()) {
    if (sends_at(iteration, in_derivatives)) {
      send(simulation);
      receive();
    }
  } else if (!exchanged_) {
    const bool predicted = timing_.send_after_predict && !in_derivatives;
    if (predicted && !wants_end_) send(simulation);
    if (awaiting_) receive();
    exchanged_ = true;
  }
  if (loads_) port_.apply(*loads_, simulation);
  const bool nothing_asked = in_derivatives && iteration == 0;  // the code was not asked yet
  return !is_tight() || done_ || wants_end_ || nothing_asked;
}

void ForceDialogue::converged(const Simulation& simulation) {
  const bool sends = !is_tight() && !timing_.send_after_predict && !wants_end_;
  if (sends) send(simulation);
}

}  // namespace mbcosim::mbdyn
