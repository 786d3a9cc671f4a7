#include "service/peer_seat.h"

#include <algorithm>

#include "coupling/handshake.h"

namespace mbcosim::server {

Heart::Heart(PeerLink& link, const Port& port, const Agreement& agreement)
    : link_(link),
      port_(port),
      agreement_(agreement),
      next_(Clock::now() + agreement.heartbeat_interval) {}

Heart::Clock::duration Heart::period() const {
  const auto timeout = agreement_.heartbeat_timeout;
  const auto listen =
      std::max<std::chrono::milliseconds>(timeout / 4, std::chrono::milliseconds(1));
  return beats() && (timeout == kNever || agreement_.heartbeat_interval < listen)
             ? agreement_.heartbeat_interval
             : listen;
}

bool Heart::beat() {
  if (agreement_.heartbeat_timeout > kNever && port_.silence() > agreement_.heartbeat_timeout)
    return false;
  if (!beats() || Clock::now() < next_) return true;
  v1::ServerMessage message;
  message.mutable_heartbeat()->set_count(++count_);
  link_.beat(message);
  next_ += agreement_.heartbeat_interval;
  return true;
}

PeerSeat::PeerSeat(const Parts& parts, const v1::Hello& hello, const Caller& caller, Call& call,
                   PeerLink& link)
    : parts_(parts),
      caller_(caller),
      session_(parts.store, hello.simulation(), caller, call, Access::couple, hello.port()),
      link_(link),
      port_(session_->port(hello.port())) {
  v1::SimulationInfo info;
  session_->fill(&info);
  const Agreement agreement =
      agree(hello, port_.model(), {info.model_digest(), info.step(), info.next_step_size()});
  heart_.emplace(link, port_, agreement);
  port_.reserve(agreement);
  v1::Welcome* welcome = welcome_.mutable_welcome();
  fill_protocol(welcome->mutable_protocol());
  port_.fill(welcome->mutable_layout());
  welcome->set_model_digest(info.model_digest());
  welcome->set_step_size(info.next_step_size());
  welcome->set_step(info.step());
  welcome->set_time(info.time());
  fill_agreed(hello, agreement, port_.model().units(), welcome->mutable_agreed());
  if (!agreement.units) return;
  port_.model().tell_units(agreement.units->peer(), welcome->mutable_layout());
  welcome->set_step_size(welcome->step_size() * agreement.units->time());
  welcome->set_time(welcome->time() * agreement.units->time());
}

PeerSeat::~PeerSeat() {
  port_.detach();
  parts_.log.peer(session_->subject(), v1::PEER_CHANGE_LEFT, port_.model().name(),
                  caller_.identity);
}

void PeerSeat::begin() {
  port_.attach(&link_, welcome_.welcome());
  parts_.log.peer(session_->subject(), v1::PEER_CHANGE_ATTACHED, port_.model().name(),
                  caller_.identity);
}

void PeerSeat::receive(const v1::PeerMessage& message) {
  session_->grants().require(session_->subject().name, caller_, Access::couple,
                             port_.model().name());
  port_.receive(message);
}

}  // namespace mbcosim::server
