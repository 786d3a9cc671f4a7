#include <charconv>
#include <cmath>
#include <sstream>

#include "model/deck_channel.h"
#include "model/drives/file_driver.h"
#include "model/drives/readers.h"
#include "model/model.h"

namespace mbcosim {

namespace {

int read_channels(Card& card, const char* what) {
  constexpr int kMost = 65536;
  const int n = read_count(card, what);
  if (n > kMost)
    card.fail("at most " + std::to_string(kMost) + " columns are allowed, got " +
              std::to_string(n));
  return n;
}

/// [interpolation, {linear|const},] [pad zeroes, {yes|no}, | bailout, {none|upper|lower|any},]
TableOptions read_table_options(Card& card) {
  TableOptions o;
  if (card.keyword("interpolation"))
    o.linear = card.required("interpolation", {"linear", "const"}) == 0;
  if (card.one_of({"pad zeroes", "pad zeros"}) >= 0) {
    o.pad_zeros = card.yes_no("pad zeroes");
  } else if (card.keyword("bailout")) {
    const int side = card.required("bailout", {"none", "upper", "lower", "any"});
    o.bail_upper = side == 1 || side == 3;
    o.bail_lower = side == 2 || side == 3;
  }
  return o;
}

/// Reads the samples of a file: `columns` numbers a row.
SampleText read_samples(Card& card, int columns) {
  std::string name;
  const std::string text = card.file_contents("file of samples", &name);
  SampleText samples = parse_samples(text, columns);
  if (!samples.error.empty()) card.fail("file driver: \"" + name + "\", " + samples.error);
  if (samples.rows == 0) card.fail("file driver: \"" + name + "\" has no samples");
  return samples;
}

/// `from file` or a number.
struct HeaderNumber {
  bool from_file = false;
  double value = 0;
};
HeaderNumber read_header_number(Card& card, const char* word) {
  if (!card.keyword(word))
    card.warn_at(card.next(), std::string("`") + word + "` is missing before its value");
  HeaderNumber n;
  n.from_file = card.keyword("from file");
  if (!n.from_file) n.value = card.real(word);
  return n;
}

double resolved(Card& card, const HeaderNumber& n, const std::string& text, const char* word) {
  if (!n.from_file) return n.value;
  double v = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (error != std::errc() || end != text.data() + text.size())
    card.fail(std::string("the file does not give the ") + word,
              std::string("its comments need a line `# ") + word + ": <number>`");
  return v;
}

/// Refuses a table that would end the run before its first step.
FileDriverPtr make_table_driver(Card& card, SampleTable table, const TableOptions& options) {
  const double t = card.model().initial_value.initial_time, first = table.time(0),
               last = table.time(table.rows() - 1);
  if ((options.bail_lower && t < first) || (options.bail_upper && t > last))
    card.fail("file driver: the initial time " + std::to_string(t) + " is outside the samples, " +
                  std::to_string(first) + " to " + std::to_string(last),
              "`bailout` ends the run there; start it within the samples or use `pad zeroes`");
  auto driver = std::make_shared<TableDriver>(std::move(table), options);
  if (options.bail_lower || options.bail_upper)
    card.builder().on_step(std::make_shared<TableWatch>(driver));
  return driver;
}

FileDriverPtr read_fixed_step(Card& card, int) {
  const int rows = card.keyword("count") ? -1 : read_count(card, "number of steps");
  SampleTable table;
  table.channels = read_channels(card, "number of channels");
  const HeaderNumber t0 = read_header_number(card, "initial time");
  const HeaderNumber dt = read_header_number(card, "time step");
  const TableOptions options = read_table_options(card);
  SampleText samples = read_samples(card, table.channels);
  if (rows >= 0) {
    if (samples.rows < rows)
      card.fail("the file has " + std::to_string(samples.rows) + " rows, " + std::to_string(rows) +
                    " were announced",
                "write `count` to take what there is");
    samples.values.resize(static_cast<std::size_t>(rows) * table.channels);
  }
  table.values = std::move(samples.values);
  table.t0 = resolved(card, t0, samples.initial_time, "initial time");
  table.dt = resolved(card, dt, samples.time_step, "time step");
  if (!(table.dt > 0 && std::isfinite(table.dt)))
    card.fail("the time step of the file driver must be positive, got " + std::to_string(table.dt));
  if (!std::isfinite(table.t0)) card.fail("the initial time of the file driver is not finite");
  return make_table_driver(card, std::move(table), options);
}

FileDriverPtr read_variable_step(Card& card, int) {
  SampleTable table;
  table.channels = read_channels(card, "number of channels");
  const TableOptions options = read_table_options(card);
  const SampleText samples = read_samples(card, table.channels + 1);
  const int columns = table.channels + 1;
  for (int row = 0; row < samples.rows; ++row) {
    const double* v = &samples.values[static_cast<std::size_t>(row) * columns];
    if (row > 0 && !(v[0] > table.times.back()))
      card.fail("the times of the file driver must increase; row " + std::to_string(row + 1) +
                " has " + std::to_string(v[0]));
    table.times.push_back(v[0]);
    table.values.insert(table.values.end(), v + 1, v + columns);
  }
  return make_table_driver(card, std::move(table), options);
}

/// Gives the channels of a driver fed by a peer a place in State::memory.
FileDriverPtr add_stream(Card& card, StreamInput stream, const std::vector<double>& initial) {
  stream.memory = card.builder().allocate_memory(stream.channels);
  for (std::size_t k = 0; k < initial.size(); ++k)
    card.builder().set_memory(stream.memory + static_cast<int>(k), initial[k]);
  auto driver = std::make_shared<StreamDriver>(stream.channels, stream.memory);
  card.model().stream_inputs.push_back(std::move(stream));
  return driver;
}

std::vector<double> read_initial_values(Card& card, int channels) {
  std::vector<double> values;
  if (!card.keyword("initial values")) return values;
  for (int k = 0; k < channels; ++k) values.push_back(card.real("initial value"));
  return values;
}

/// Keeps what the card says with the model, unless the stream is a port of the daemon.
void keep_channel(Card& card, DeckChannel channel, const StreamInput& stream) {
  const bool text = channel.content == DeckChannel::Content::text;
  channel.port = stream.name;
  channel.card = (text ? "socket drive \"" : "stream drive \"") + stream.name + "\"";
  channel.every = stream.every;
  channel.at_start = stream.receive_first;
  if (channel.address.kind != ChannelAddress::Kind::port)
    card.builder().on_step(std::make_shared<DeckChannel>(std::move(channel)));
}

void read_input_flags(Card& card, DeckChannel& channel) {
  enum { signal, no_signal, blocking, non_blocking };
  for (;;) {
    const int flag = card.one_of({"signal", "no signal", "blocking", "non blocking"});
    if (flag < 0) return;
    if (flag == signal || flag == no_signal) channel.signal = flag == signal;
    if (flag == blocking || flag == non_blocking) channel.blocking = flag == blocking;
  }
}

/// Number of values, and those that they start with where they are given.
std::string input_text(int channels, const std::vector<double>& initial) {
  std::ostringstream s;
  s << channels;
  for (const double value : initial) s << ' ' << value;
  return s.str();
}

FileDriverPtr read_stream(Card& card, int label) {
  constexpr int kDefaultPort = 9012;
  StreamInput stream;
  DeckChannel channel;
  channel.content = DeckChannel::Content::input;
  channel.label = label;
  stream.where = card.next();
  if (card.one_of({"name", "stream drive name"}) < 0) card.fail_expected("stream: `name` expected");
  stream.name = card.quoted("name");
  channel.address = read_channel_address(card, kDefaultPort);
  if (channel.address.kind == ChannelAddress::Kind::udp)
    card.fail("stream: input over UDP is not supported", "write `socket type, tcp`");
  read_input_flags(card, channel);
  if (card.keyword("input every")) stream.every = read_count(card, "steps between two inputs");
  if (card.keyword("receive first")) stream.receive_first = card.yes_no("receive first");
  if (card.keyword("timeout")) {
    channel.timeout = card.real("timeout");
    if (!(channel.timeout > 0)) card.fail("stream: the timeout must be positive");
  }
  if (channel.address.kind == ChannelAddress::Kind::port && card.peek_word() == "echo")
    card.fail_at(card.next(), "stream: `echo` is not supported",
                 "leave it out; the service's telemetry records what is received");
  read_channel_echo(card, channel);
  stream.channels = read_channels(card, "number of columns");
  const std::vector<double> initial = read_initial_values(card, stream.channels);
  read_channel_modifier(card, stream.channels, channel);
  channel.log_end = input_text(stream.channels, initial);
  keep_channel(card, std::move(channel), stream);
  return add_stream(card, std::move(stream), initial);
}

/// [noauth | password, user, "name", credentials, "word" [, salt format, "..."]]
void read_authentication(Card& card, DeckChannel& channel) {
  if (!card.more() || card.keyword("noauth")) return;
  if (!card.keyword("password"))
    card.fail_expected("socket: an authentication that is supported expected",
                       "write `noauth`, or `password, user, \"name\", credentials, \"word\"`");
  if (!card.keyword("user")) card.fail_expected("socket: `user` expected");
  channel.user = card.quoted("user");
  if (!card.keyword("credentials")) card.fail_expected("socket: `credentials` expected");
  if (!card.at_string())
    card.fail_expected("socket: the word expected: a run asks nobody for it",
                       "write it in quotes after `credentials`");
  channel.password = card.quoted("credentials");
  if (channel.user.empty() || channel.password.empty())
    card.fail("socket: the user and the word must not be empty");
  if (card.keyword("salt format")) card.quoted("salt format");  // how MBDyn keeps the word
}

FileDriverPtr read_socket(Card& card, int label) {
  constexpr int kDefaultPort = 5555;
  DeckChannel channel;
  channel.content = DeckChannel::Content::text;
  channel.label = label;
  StreamInput stream;
  stream.where = card.next();
  stream.channels = read_channels(card, "number of columns");
  stream.name = "socket" + std::to_string(card.model().stream_inputs.size() + 1);
  const std::vector<double> initial = read_initial_values(card, stream.channels);
  if (card.peek_word() == "create")
    card.fail_at(card.next(), "socket: the driver always listens", "leave `create` out");
  channel.address = read_channel_address(card, kDefaultPort);
  channel.address.create = true;
  if (channel.address.kind == ChannelAddress::Kind::udp)
    card.fail("socket: input over UDP is not supported", "write `socket type, tcp`");
  read_authentication(card, channel);
  keep_channel(card, std::move(channel), stream);
  return add_stream(card, std::move(stream), initial);
}

}  // namespace

void register_file_drivers(Registry& registry) {
  registry.file_driver({"fixed step"}, read_fixed_step);
  registry.file_driver({"variable step"}, read_variable_step);
  registry.file_driver({"stream", "socket stream", "RTAI input"}, read_stream);
  registry.file_driver({"socket"}, read_socket);
}

}  // namespace mbcosim
