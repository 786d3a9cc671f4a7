/// File driver `socket`: whoever connects sets one channel by lines of text.
///
///   [user: NAME, password: WORD] label: CHANNEL, {value: X | inc: {yes|no} | imp: {yes|no}} …, .
///
/// A line each. Connections that wait are served before each step, one after the other; nobody is
/// waited for but to end the lines.
/// `inc: yes` makes a channel incremental, values are added to it; `imp: yes` impulsive, its value
/// lasts one step. Both stay until a `no`.
///
/// N.B. as in MBDyn, a value acts once more with each line after it, and `no` ends both: codes put
/// `inc` and `imp` before `value`. Source: MBDyn input manual, socket driver.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mbdyn/link.h"
#include "simulation/simulation.h"

namespace mbcosim::mbdyn {

/// How values act on a channel; kept from one connection to the next.
struct ChannelHabit {
  bool incremental = false, impulsive = false;
};

/// The lines of one connection.
class TextDialogue {
 public:
  /// `values`, `habits`: (channels), changed line by line. All outlive this.
  TextDialogue(const DeckChannel& channel, std::vector<double>& values,
               std::vector<ChannelHabit>& habits)
      : channel_(channel), values_(values), habits_(habits) {}
  /// False: it was the last one. Throws ChannelLost with what is wrong with the line.
  bool take(const std::string& line);

 private:
  void take_credential(const std::string& word, const std::string& text);
  void take_label(const std::string& text);
  void take_value(const std::string& word, const std::string& text);
  void act();

  enum class Next { user, password, label, values } next_ = Next::user;
  const DeckChannel& channel_;
  std::vector<double>& values_;
  std::vector<ChannelHabit>& habits_;
  std::string user_;
  std::size_t at_ = 0;  ///< the connection's channel, from 0
  double value_ = 0;
  bool has_value_ = false;
};

class TextSocket {
 public:
  TextSocket(const DeckChannel& channel, const Simulation& simulation,
             std::unique_ptr<Listener> listener, Patience patience);
  /// Once a step, whatever becomes of its attempts. Connections that go wrong are told and closed,
  /// the run goes on; all together take no longer than the patience.
  void step_begins(Simulation& simulation);

 private:
  void serve(Link& link, Clock::time_point end, std::vector<double>& values);
  void warn(const std::string& text);

  const DeckChannel channel_;
  const std::unique_ptr<Listener> listener_;
  const Patience patience_;
  std::vector<ChannelHabit> habits_;  ///< (channels)
  int handle_ = -1, warnings_ = 0;
};

}  // namespace mbcosim::mbdyn
