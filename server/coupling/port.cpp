#include "coupling/port.h"

#include <google/protobuf/util/time_util.h>

#include <cmath>
#include <exception>

#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr auto kLook = std::chrono::milliseconds(10);  // how soon a cancelled step is noticed

std::string in_port(const std::string& name, const std::string& text) {
  return "port \"" + name + "\": " + text;
}

constexpr std::size_t kLongestText = 500;  // that a peer may add to a message

PeerRejected to_rejection(const std::string& name, const v1::Rejection& rejection) {
  PeerRejected rejected;
  rejected.text = in_port(name, "the peer rejects the step");
  if (!rejection.text().empty()) rejected.text += ": " + rejection.text().substr(0, kLongestText);
  if (rejection.has_preferred_step_size()) rejected.preferred = rejection.preferred_step_size();
  return rejected;
}

}  // namespace

void Port::fill(v1::PortLayout* out) const {
  const Guard guard(mutex_);
  *out = model_.layout();
  if (model_.units()) to_proto(*model_.units(), out->mutable_units());
  out->set_has_peer(link_ != nullptr);
  *out->mutable_peer_timeout() =
      google::protobuf::util::TimeUtil::MillisecondsToDuration(agreement_.timeout.count());
}

std::optional<v1::PortWait> Port::waiting() const {
  const Guard guard(mutex_);
  if (!waiting_since_) return std::nullopt;
  v1::PortWait wait;
  wait.set_port(model_.name());
  wait.set_seconds(std::chrono::duration<double>(Clock::now() - *waiting_since_).count());
  wait.set_has_peer(link_ != nullptr);
  return wait;
}

// ------------------------------------------------------------------ the peer's thread

void Port::reserve(const Agreement& agreement) {
  const Guard guard(mutex_);
  if (reserved_)
    throw Refusal(v1::REASON_PORT_TAKEN, in_port(model_.name(), "a peer is attached already"));
  reserved_ = true;
  const int generation = agreement_.generation + 1;
  agreement_ = agreement;
  agreement_.generation = generation;
}

void Port::attach(PeerLink* link, const v1::Welcome& welcome) {
  {
    const Guard guard(mutex_);
    if (recorder_) recorder_->attached(model_.name(), welcome);
    link_ = link;
    had_peer_ = true;
    heard_.store(Clock::now().time_since_epoch().count());
    index_ = 0;
    awaited_ = false;
    answer_.reset();
    peer_failure_.clear();
    refused_.clear();
    rejection_.reset();
    if (ended_) link_->refuse(*ended_);
  }
  changed_.notify_all();
}

void Port::end(const Refusal& why) {
  const Guard guard(mutex_);
  ended_ = why;
  if (link_) link_->refuse(why);
}

void Port::detach() {
  {
    const Guard guard(mutex_);
    while (link_in_use_) changed_.wait(mutex_);
    if (recorder_ && link_) recorder_->detached(model_.name());
    link_ = nullptr;
    reserved_ = false;
  }
  changed_.notify_all();
}

Port::Clock::duration Port::silence() const {
  return Clock::now() - Clock::time_point(Clock::duration(heard_.load()));
}

void Port::receive(const v1::PeerMessage& message) {
  heard_.store(Clock::now().time_since_epoch().count(), std::memory_order_relaxed);
  if (message.has_heartbeat()) return;
  if (!message.has_exchange())
    throw Refusal(v1::REASON_OUT_OF_TURN,
                  "after `hello` a peer sends only `exchange` and `heartbeat`");
  try {
    deliver(message.exchange());
  } catch (const Refusal& refusal) {
    const Guard guard(mutex_);
    refused_ = refusal.what();
    throw;
  }
}

void Port::deliver(const v1::PeerExchange& answer) {
  {
    const Guard guard(mutex_);
    if (answer.index() < 1 || answer.index() > index_ || (answer.index() == index_ && answer_))
      throw Refusal(v1::REASON_OUT_OF_TURN,
                    in_port(model_.name(), "answer to exchange " + std::to_string(answer.index()) +
                                               "; the last one sent is " + std::to_string(index_)));
    if (answer.index() < index_ || !awaited_) return;
    peer_failure_.clear();
    rejection_.reset();
    answer_ = take_content(answer);
    if (recorder_) received_ = answer;
  }
  changed_.notify_all();
}

Answer Port::take_content(const v1::PeerExchange& exchange) {
  Answer values;
  switch (exchange.content_case()) {
    case v1::PeerExchange::kAnswer: {
      const std::string wrong = model_.decode(exchange.answer(), agreement_, &values);
      if (!wrong.empty()) throw Refusal(v1::REASON_BAD_ARGUMENT, in_port(model_.name(), wrong));
      break;
    }
    case v1::PeerExchange::kFailure:
      peer_failure_ = exchange.failure().empty() ? "it gave no reason" : exchange.failure();
      break;
    case v1::PeerExchange::kReject: {
      v1::Rejection rejection = exchange.reject();
      if (agreement_.units) agreement_.units->to_deck(&rejection);
      check_rejection(rejection);
      rejection_ = to_rejection(model_.name(), rejection);
      break;
    }
    default:
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    in_port(model_.name(), "`exchange` must have `answer`, `failure` or `reject`"));
  }
  return values;
}

void Port::check_rejection(const v1::Rejection& rejection) const {
  if (!rejection.has_preferred_step_size()) return;
  const double preferred = rejection.preferred_step_size();
  if (preferred > 0 && std::isfinite(preferred)) return;
  throw Refusal(v1::REASON_BAD_ARGUMENT,
                in_port(model_.name(), "`reject.preferred_step_size` must be positive, got " +
                                           std::to_string(preferred)));
}

// ------------------------------------------------------------------ the session's thread

Agreement Port::agreement() const {
  const Guard guard(mutex_);
  return agreement_;
}

bool Port::has_peer() const {
  const Guard guard(mutex_);
  return link_ != nullptr;
}

bool Port::had_peer() const {
  const Guard guard(mutex_);
  return agreement_.generation > 0;
}

void Port::expect_peer(const Agreement& left) {
  const Guard guard(mutex_);
  if (agreement_.generation > 0) return;
  agreement_ = left;
  agreement_.generation = 1;
}

bool Port::is_idle() const {
  const Guard guard(mutex_);
  return model_.layout().optional() && agreement_.generation == 0;
}

bool Port::is_waiting() const {
  const Guard guard(mutex_);
  return awaited_;
}

void Port::forget() {
  const Guard guard(mutex_);
  awaited_ = false;
  answer_.reset();
}

void Port::await_peer(const CancelToken& cancel) {
  const Guard guard(mutex_);
  const bool patient =
      agreement_.policy == v1::PEER_POLICY_WAIT || agreement_.policy == v1::PEER_POLICY_FAIL_STEP;
  const bool idle = model_.layout().optional() && agreement_.generation == 0;
  if (link_ || !patient || idle) return;
  const bool forever = agreement_.policy == v1::PEER_POLICY_WAIT;
  const Clock::time_point deadline = Clock::now() + (forever ? longest_wait_ : agreement_.timeout);
  waiting_since_ = Clock::now();
  while (!link_ && Clock::now() < deadline && !cancel.cancelled()) changed_.wait_for(mutex_, kLook);
  waiting_since_.reset();
}

// Without the lock, since a link may block while the peer does not read; `detach` waits for the
// end, whatever is thrown.
template <class Use>
void Port::use_link(Use&& use) {
  PeerLink* link = link_;
  link_in_use_ = true;
  mutex_.unlock();
  std::exception_ptr thrown;
  try {
    use(*link);
  } catch (...) {
    thrown = std::current_exception();
  }
  mutex_.lock();
  link_in_use_ = false;
  changed_.notify_all();
  if (thrown) std::rethrow_exception(thrown);
}

// A broken link is noticed by the peer's thread, which detaches.
void Port::send_message(const v1::ServerMessage& message, const CancelToken& cancel) {
  const Clock::time_point deadline = Clock::now() + agreement_.timeout;
  use_link([&](PeerLink& link) { link.send(message, deadline, cancel); });
}

void Port::send(v1::ServerMessage& message, int generation, const CancelToken& cancel) {
  const Guard guard(mutex_);
  if (!link_ || generation != agreement_.generation) return;
  message.mutable_exchange()->set_index(++index_);
  awaited_ = true;
  answer_.reset();
  if (recorder_) recorder_->sent(model_.name(), message);
  send_message(message, cancel);
}

std::optional<Answer> Port::take(const CancelToken& cancel) {
  Guard guard(mutex_);
  for_answer_.begin(Clock::now());
  if (link_ && !link_->pulls()) {
    guard.unlock();
    look_for_answer();
    guard.lock();
  }
  const bool forever = agreement_.policy == v1::PEER_POLICY_WAIT;
  const Clock::time_point deadline = Clock::now() + (forever ? longest_wait_ : agreement_.timeout);
  waiting_since_ = Clock::now();
  while (awaited_ && !answer_ && link_ && Clock::now() < deadline && !cancel.cancelled())
    if (!link_->pulls() || !pull()) changed_.wait_for(mutex_, kLook);
  waiting_since_.reset();
  for_answer_.end(Clock::now());
  const bool answered = awaited_ && answer_.has_value();
  const bool late = awaited_ && !answered && link_;
  awaited_ = false;
  if (recorder_ && answered) recorder_->received(model_.name(), received_);
  if (!answered) return go_on_without(late ? "the peer did not answer in time" : why_gone());
  if (rejection_) throw PeerRejected(*rejection_);
  if (!peer_failure_.empty())
    return go_on_without("the peer failed: " + peer_failure_.substr(0, kLongestText));
  return std::move(answer_);
}

// Of a quick peer: another thread brings it, which would have to wake this one.
void Port::look_for_answer() {
  for_answer_.sees([this] {
    const Guard guard(mutex_);
    return !awaited_ || answer_ || !link_;
  });
}

// One look at a link that pulls. False: nothing will come through it any more.
bool Port::pull() {
  PeerLink::Pulled pulled = PeerLink::Pulled::closed;
  use_link([&](PeerLink& link) {
    pulled = link.pull(&pulled_, Clock::now() + kLook);
    try {
      if (pulled == PeerLink::Pulled::message) receive(pulled_);
    } catch (const Refusal& refusal) {
      link.refuse(refusal);
      pulled = PeerLink::Pulled::closed;
    }
  });
  return pulled != PeerLink::Pulled::closed;
}

std::string Port::why_gone() const {
  if (!had_peer_) return "no peer has attached to it";
  return refused_.empty() ? "the peer is gone"
                          : "the peer was sent away: " + refused_.substr(0, kLongestText);
}

void Port::lose(const std::string& why) { throw PeerLost{in_port(model_.name(), why)}; }

std::optional<Answer> Port::go_on_without(const std::string& why) {
  if (recorder_) recorder_->lost(model_.name(), why);
  if (on_missed_) on_missed_(why);
  switch (agreement_.policy) {
    case v1::PEER_POLICY_HOLD_LAST:
      return std::nullopt;
    case v1::PEER_POLICY_ZERO:
      return Answer{std::vector<double>(static_cast<std::size_t>(model_.answer_size()), 0.0),
                    false,
                    false,
                    {},
                    {}};
    default:
      lose(why);
  }
}

void Port::notify(bool accepted, std::int64_t step, double time, const CancelToken& cancel) {
  v1::ServerMessage message;
  v1::StepNotice* notice = accepted ? message.mutable_accepted() : message.mutable_rejected();
  *notice = step_notice(step, time);
  const Guard guard(mutex_);
  if (!link_) return;
  if (agreement_.units) agreement_.units->to_peer(notice);
  if (recorder_) recorder_->sent(model_.name(), message);
  send_message(message, cancel);
}

}  // namespace mbcosim::server
