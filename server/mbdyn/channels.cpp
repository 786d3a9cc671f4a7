#include "mbdyn/channels.h"

#include <fstream>

#include "mbdyn/file_wire.h"
#include "mbdyn/socket_wire.h"

namespace mbcosim::mbdyn {
namespace {

using Kind = ChannelAddress::Kind;
using Content = DeckChannel::Content;

bool listens(const DeckChannel& channel) {
  return channel.address.create && channel.address.kind != Kind::files;
}

std::string name_of(const DeckChannel& channel) {
  if (channel.address.kind == Kind::files) return channel.card;
  return channel.card + " (" + text_of(channel.address) + ")";
}

/// Whoever connects at any time is served, and nobody is waited for.
bool takes_anybody(const DeckChannel& channel) { return channel.content == Content::text; }

std::unique_ptr<Listener> make_listener(const DeckChannel& channel) {
  constexpr int kOne = 1, kMany = 64;
  return std::make_unique<Listener>(channel.address, name_of(channel),
                                    takes_anybody(channel) ? kMany : kOne);
}

/// A stream's own time-out is kept when it is the shorter one.
Patience patience_of(const DeckChannel& channel, Patience patience) {
  const auto own = std::chrono::milliseconds(static_cast<long long>(1000 * channel.timeout));
  if (channel.timeout > 0 && own < patience.time) patience.time = own;
  return patience;
}

void write_layout(const DeckChannel& channel, const ForcePort& port, const Simulation& simulation) {
  if (channel.echo.empty()) return;
  constexpr int kDigits = 6;
  std::ofstream out(channel.echo, std::ios::trunc);
  out << state_text(port.form(), port.state(simulation), kDigits, /*scientific=*/false);
  if (!out) throw ChannelLost(channel.card + ": cannot write \"" + channel.echo + "\"");
}

}  // namespace

std::vector<std::string> files_changed_by(const DeckChannel& channel) {
  std::vector<std::string> files = files_changed_at(channel.address);
  if (!channel.echo.empty()) files.push_back(channel.echo);
  return files;
}

Channels::Channels(const std::vector<const DeckChannel*>& channels, Simulation& simulation,
                   const Patience& patience, bool pads_labels)
    : simulation_(simulation), patience_(patience), pads_labels_(pads_labels) {
  const auto end = Clock::now() + patience.time;
  std::vector<std::unique_ptr<Listener>> listeners(channels.size());
  for (std::size_t k = 0; k < channels.size(); ++k)
    if (listens(*channels[k])) listeners[k] = make_listener(*channels[k]);
  std::vector<std::unique_ptr<Link>> links(channels.size());
  for (std::size_t k = 0; k < channels.size(); ++k)
    if (!listeners[k] && channels[k]->address.kind != Kind::files)
      links[k] = connect_to(channels[k]->address, name_of(*channels[k]), end, patience);
  for (std::size_t k = 0; k < channels.size(); ++k)
    if (listeners[k] && !takes_anybody(*channels[k]))
      links[k] = listeners[k]->accept(end, patience);
  for (std::size_t k = 0; k < channels.size(); ++k) {
    if (takes_anybody(*channels[k]))
      text_sockets_.push_back(std::make_unique<TextSocket>(*channels[k], simulation_,
                                                           std::move(listeners[k]), patience));
    else
      open(*channels[k], std::move(links[k]));
  }
  simulation.set_exchange([this](int iteration) { return exchange(iteration, false); });
  simulation.set_start_exchange([this](int iteration) { return exchange(iteration, true); },
                                [this](StartEvent event) { observe(event); });
  simulation.set_attempt_ended([this](bool) { attempt_failed(); });
}

Channels::~Channels() {
  simulation_.set_exchange({});
  simulation_.set_start_exchange({}, {});
  simulation_.set_attempt_ended({});
  end();
}

void Channels::open(const DeckChannel& channel, std::unique_ptr<Link> link) {
  if (link) link->set_patience(patience_of(channel, patience_).time);
  if (channel.content == Content::output) {
    senders_.push_back(std::make_unique<StreamSender>(channel, simulation_, std::move(link)));
  } else if (channel.content == Content::input) {
    receivers_.push_back(std::make_unique<StreamReceiver>(channel, simulation_, std::move(link)));
  } else {
    ForcePort port(channel, simulation_);
    port.form().pads_labels = pads_labels_;
    write_layout(channel, port, simulation_);
    std::unique_ptr<ForceWire> wire;
    if (link)
      wire = std::make_unique<SocketWire>(std::move(link), port.form(), channel.address.create);
    else
      wire = std::make_unique<FileWire>(channel.address, channel.card, port.form(), patience_);
    forces_.push_back(std::make_unique<ForceDialogue>(channel, std::move(port), std::move(wire)));
  }
}

void Channels::step_begins() {
  for (const auto& receiver : receivers_) receiver->step_begins(simulation_);
  for (const auto& socket : text_sockets_) socket->step_begins(simulation_);
  for (const auto& force : forces_) force->step_begins();
}

void Channels::attempt_failed() {
  for (const auto& force : forces_) force->attempt_failed();
}

void Channels::converged() {
  for (const auto& force : forces_) force->converged(simulation_);
  for (const auto& sender : senders_) sender->converged(simulation_);
}

void Channels::observe(StartEvent event) {
  switch (event) {
    case StartEvent::assembled:
      for (const auto& force : forces_) force->start(simulation_);
      for (const auto& sender : senders_) sender->start(simulation_);
      return;
    case StartEvent::derivatives_solved:
      for (const auto& force : forces_) force->converged(simulation_);
      return;
    case StartEvent::dummy_step_begins:
      return step_begins();
    case StartEvent::dummy_step_ended:
      return converged();
  }
}

bool Channels::exchange(int iteration, bool in_derivatives) {
  bool settled = true;
  for (const auto& force : forces_)
    settled = force->exchange(simulation_, iteration, in_derivatives) && settled;
  return settled;
}

Status Channels::start(const CancelToken* cancel) {
  for (const auto& receiver : receivers_) receiver->start(simulation_);
  return simulation_.start(cancel);
}

StepReport Channels::step(const CancelToken* cancel) {
  step_begins();
  StepReport report = simulation_.step(cancel);
  if (!report.error) converged();
  return report;
}

std::optional<std::string> Channels::wants_end() const {
  for (const auto& force : forces_)
    if (force->wants_end()) return force->name();
  for (const auto& sender : senders_)
    if (sender->wants_end()) return sender->name();
  return std::nullopt;
}

void Channels::end() {
  if (ended_) return;
  ended_ = true;
  const auto until = Clock::now() + patience_.farewell;
  for (const auto& force : forces_) force->end(until);
}

}  // namespace mbcosim::mbdyn
