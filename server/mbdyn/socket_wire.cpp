#include "mbdyn/socket_wire.h"

#include <algorithm>

namespace mbcosim::mbdyn {
namespace {

constexpr std::chrono::milliseconds kFarewell{1000};

}  // namespace

SocketWire::SocketWire(std::unique_ptr<Link> link, ForceForm form, bool listened)
    : link_(std::move(link)), form_(std::move(form)) {
  if (listened)
    answer_request();
  else
    link_->send(std::string(1, kNegotiate) + encode_request(form_) + std::string(1, kAccepted));
}

void SocketWire::answer_request() {
  const auto refuse = [this](const std::string& why) {
    try {
      link_->send(std::string(1, kEnd));
      link_->finish(kFarewell);
    } catch (const ChannelLost&) {  // who has gone need not hear it
    }
    throw ChannelLost(link_->name() + ": " + why);
  };
  const char command = link_->receive(1)[0];
  if (command != kNegotiate)
    refuse("the peer must begin with 7 (negotiation), it sent " +
           std::to_string(static_cast<unsigned char>(command)));
  const std::string mismatches = check_request(link_->receive(kRequestSize), form_);
  if (!mismatches.empty()) refuse("the peer does not fit: " + mismatches);
  link_->send(std::string(1, kAccepted));
}

// Clients read a block in one call that waits for all of it.
void SocketWire::send(Command command, const ForceState& state) {
  link_->send(std::string(1, command) + encode_state(form_, state));
}

Command SocketWire::receive(ForceLoads& loads) {
  const char command = link_->receive(1)[0];
  switch (command) {
    case kNoData:
    case kEnd:
      break;
    case kData:
    case kLastData:
      try {
        loads = decode_loads(form_, link_->receive(loads_size(form_)));
      } catch (const ChannelLost& e) {
        const std::string what = e.what();
        const bool named = what.rfind(link_->name(), 0) == 0;
        throw ChannelLost(named ? what : link_->name() + ": " + what);
      }
      break;
    default:
      throw ChannelLost(link_->name() + ": unknown command " +
                        std::to_string(static_cast<unsigned char>(command)) + " from the peer");
  }
  return static_cast<Command>(command);
}

void SocketWire::end(Clock::time_point until) {
  using std::chrono::milliseconds;
  const auto left = [until] {
    return std::max(std::chrono::duration_cast<milliseconds>(until - Clock::now()),
                    milliseconds(0));
  };
  try {
    link_->set_patience(left());
    link_->send(std::string(1, kEnd));
    link_->finish(left());
  } catch (const ChannelLost&) {  // who is gone needs no farewell
  }
}

}  // namespace mbcosim::mbdyn
