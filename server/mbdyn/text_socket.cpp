#include "mbdyn/text_socket.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "model/text.h"

namespace mbcosim::mbdyn {
namespace {

constexpr std::size_t kLongestLine = 1023;
constexpr int kMostLines = 1000, kMostConnections = 64, kMostWarnings = 20;

/// In lower case, without blanks: words come in any case.
std::string word_of(std::string_view given) {
  std::string text(trimmed(given));
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// What a peer sent, for a message.
std::string shown(std::string text) {
  constexpr std::size_t kMost = 60;
  if (text.size() > kMost) text.replace(kMost, std::string::npos, "...");
  for (char& c : text)
    if (c < 0x20 || c > 0x7e) c = '?';
  return "\"" + text + "\"";
}

/// The whole text is a number of this type.
template <class T>
bool read(const std::string& text, T& number) {
  const char* first = text.data() + (text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0);
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(first, last, number);
  return error == std::errc() && end == last;
}

bool read_yes_no(const std::string& word, const std::string& text) {
  const std::string answer = word_of(text);
  if (answer != "yes" && answer != "no")
    throw ChannelLost("`" + word + ":` takes yes or no, not " + shown(text));
  return answer == "yes";
}

/// Without its end. Throws ChannelLost.
std::string receive_line(Link& link, Clock::time_point end) {
  using std::chrono::milliseconds;
  std::string line;
  for (;;) {
    const auto left = std::chrono::ceil<milliseconds>(end - Clock::now());
    link.set_patience(std::max(left, milliseconds(0)));
    const char c = link.receive(1)[0];
    if (c == '\n') return line;
    line += c;
    if (line.size() > kLongestLine)
      throw ChannelLost("a line has more than " + std::to_string(kLongestLine) + " bytes");
  }
}

}  // namespace

// ------------------------------------------------------------------ lines

bool TextDialogue::take(const std::string& line) {
  const std::string all(trimmed(line));
  if (all == ".") {
    if (next_ != Next::values) throw ChannelLost("missing label");
    return false;
  }
  const std::size_t colon = all.find(':');
  if (colon == std::string::npos) throw ChannelLost("no `word: text`, but " + shown(all));
  const std::string word = word_of(std::string_view(all).substr(0, colon));
  const std::string text(trimmed(std::string_view(all).substr(colon + 1)));
  if (word == "user" || word == "password")
    take_credential(word, text);
  else if (word == "label")
    take_label(text);
  else if (word == "value" || word == "inc" || word == "imp")
    take_value(word, text);
  else
    throw ChannelLost("unknown word " + shown(word));
  return true;
}

/// Asked for or not, the two lines come first and in this order.
void TextDialogue::take_credential(const std::string& word, const std::string& text) {
  const bool user = word == "user";
  if (next_ != (user ? Next::user : Next::password))
    throw ChannelLost("`" + word + ":` is out of turn");
  next_ = user ? Next::password : Next::label;
  if (user)
    user_ = text;
  else if (!channel_.user.empty() && (user_ != channel_.user || text != channel_.password))
    throw ChannelLost("wrong user or password");
}

void TextDialogue::take_label(const std::string& text) {
  const bool allowed = next_ == Next::label || (next_ == Next::user && channel_.user.empty());
  if (!allowed && next_ == Next::values) throw ChannelLost("a connection sets one channel");
  if (!allowed) throw ChannelLost("missing user or password");
  long label = 0;
  if (!read(text, label) || label < 1 || label > static_cast<long>(values_.size()))
    throw ChannelLost("illegal label " + shown(text) + ": the channels are 1 to " +
                      std::to_string(values_.size()));
  at_ = static_cast<std::size_t>(label - 1);
  next_ = Next::values;
}

void TextDialogue::take_value(const std::string& word, const std::string& text) {
  if (next_ != Next::values) throw ChannelLost("missing label");
  ChannelHabit& habit = habits_[at_];
  if (word == "value") {
    double number = 0;
    if (!read(text, number) || !std::isfinite(number))
      throw ChannelLost("a value is a finite number, not " + shown(text));
    value_ = number;
    has_value_ = true;
  } else if (!read_yes_no(word, text)) {
    habit = {};
  } else {
    (word == "inc" ? habit.incremental : habit.impulsive) = true;
  }
  if (has_value_) act();
}

void TextDialogue::act() {
  const double value = habits_[at_].incremental ? values_[at_] + value_ : value_;
  if (!std::isfinite(value)) throw ChannelLost("the sum of the increments is not finite");
  values_[at_] = value;
}

// ------------------------------------------------------------------ connections

TextSocket::TextSocket(const DeckChannel& channel, const Simulation& simulation,
                       std::unique_ptr<Listener> listener, Patience patience)
    : channel_(channel), listener_(std::move(listener)), patience_(std::move(patience)) {
  handle_ = simulation.find_variable("stream." + channel.port);
  habits_.resize(static_cast<std::size_t>(simulation.variables()[handle_].size));
}

void TextSocket::step_begins(Simulation& simulation) {
  std::vector<double> values;
  simulation.get(handle_, values);
  for (std::size_t k = 0; k < habits_.size(); ++k)
    if (habits_[k].impulsive) values[k] = 0;
  const auto end = Clock::now() + patience_.time;
  for (int k = 0; k < kMostConnections && Clock::now() < end; ++k) {
    const auto link = listener_->accept_if_any(patience_);
    if (!link) break;
    serve(*link, end, values);
  }
  (void)simulation.set(handle_, values);
}

void TextSocket::serve(Link& link, Clock::time_point end, std::vector<double>& values) {
  TextDialogue dialogue(channel_, values, habits_);
  try {
    for (int k = 0; k < kMostLines; ++k)
      if (!dialogue.take(receive_line(link, end))) return;
    throw ChannelLost("more than " + std::to_string(kMostLines) + " lines");
  } catch (const ChannelLost& lost) {
    if (patience_.cancelled()) throw;
    const std::string what = lost.what(), name = link.name() + ": ";
    const bool named = what.rfind(name, 0) == 0, late = what.rfind(name + "silent for", 0) == 0;
    warn(name + (late    ? "a connection did not end its lines in time"
                 : named ? "a connection was " + what.substr(name.size())
                         : what));
  }
}

/// Whoever may connect could fill a log.
void TextSocket::warn(const std::string& text) {
  if (warnings_ == kMostWarnings) return;
  patience_.warn(text + (++warnings_ < kMostWarnings ? "; the run goes on"
                                                     : "; further mistakes are not told"));
}

}  // namespace mbcosim::mbdyn
