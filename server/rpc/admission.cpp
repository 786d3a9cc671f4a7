#include "rpc/admission.h"

#include <utility>

#include "wire/refusal.h"

namespace mbcosim::server {

Admission::Ticket::~Ticket() {
  if (admission_) admission_->leave(*this);
}

void Admission::Ticket::swap(Ticket& other) noexcept {
  std::swap(admission_, other.admission_);
  std::swap(identity_, other.identity_);
  std::swap(connection_, other.connection_);
  std::swap(stream_, other.stream_);
}

Admission::Ticket Admission::admit(const std::string& identity, const std::string& connection,
                                   bool stream) {
  Guard guard(mutex_);
  if (all_ >= limits_.calls)
    throw limit_refusal("open_calls", limits_.calls, "the server has as many calls as are allowed");
  const auto known = identities_.find(identity);
  const Count before = known == identities_.end() ? Count{} : known->second;
  if (stream && before.streams >= limits_.identity_streams)
    throw limit_refusal("identity_streams", limits_.identity_streams,
                        identity + " has as many streams as one identity may have");
  if (!stream && before.calls >= limits_.identity_calls)
    throw limit_refusal("identity_calls", limits_.identity_calls,
                        identity + " has as many calls under way as one identity may have");
  const auto over = connections_.find(connection);
  if (over != connections_.end() && over->second >= limits_.connection_calls)
    throw limit_refusal("connection_calls", limits_.connection_calls,
                        "the connection carries as many calls as are allowed");
  // Nothing is kept of a call that was refused.
  Count& own = identities_[identity];
  if (!connection.empty()) ++connections_[connection];
  ++(stream ? own.streams : own.calls);
  ++all_;
  return Ticket(this, identity, connection, stream);
}

void Admission::leave(const Ticket& ticket) {
  Guard guard(mutex_);
  --all_;
  const auto own = identities_.find(ticket.identity_);
  --(ticket.stream_ ? own->second.streams : own->second.calls);
  if (own->second.calls == 0 && own->second.streams == 0) identities_.erase(own);
  if (ticket.connection_.empty()) return;
  const auto over = connections_.find(ticket.connection_);
  if (--over->second == 0) connections_.erase(over);
}

}  // namespace mbcosim::server
