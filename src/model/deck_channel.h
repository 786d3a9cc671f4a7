/// Channels to external codes that a deck names: sockets and files of the reference solver.
#pragma once

#include <string>
#include <vector>

#include "model/drive.h"
#include "model/structural_port.h"

namespace mbcosim {

class Card;
class Model;

/// Where the code is met.
struct ChannelAddress {
  enum class Kind {
    port,   ///< `grpc`: at the daemon's port, nowhere else
    local,  ///< Unix socket `path`
    tcp,    ///< `host`, `port`
    udp,
    files  ///< `in` and `out`
  } kind = Kind::port;
  bool create = false;  ///< the deck's side listens
  std::string path;
  std::string host = "127.0.0.1";
  int port = 0;
  std::string in, out;
  bool unlink = false;      ///< files: `in` is removed when it was read
  bool no_clobber = false;  ///< files: `out` is not written before it was removed
  double sleep_time = 1;    ///< files: between two looks [s]
  int precision = 6;        ///< files: digits after the point
};

/// Layout of the numbers in a stream's messages: `modifier, copy cast`.
struct ChannelField {
  enum class Type {
    int8,
    uint8,
    int16,
    uint16,
    int32,
    uint32,
    float32,
    float64
  } type = Type::float64;
  bool swapped = false;  ///< bytes in the reverse order
  int skip = 0;          ///< bytes left before it
};

/// When an external force meets its code. Source: MBDyn input manual, external forces.
struct ChannelTiming {
  bool listens = true;  ///< false: `none`, loads are never read
  PortCoupling coupling = PortCoupling::loose;
  int every = 1;  ///< tight: iterations between exchanges
  bool send_after_predict = true;
};

/// One channel, as its card has it. The engine opens nothing: whoever runs the model carries out
/// what the deck says, or leaves the channel's values as they are. The model keeps channels among
/// its step listeners.
struct DeckChannel : StepListener {
  enum class Content { structural, mapped, modal, output, input, text };

  Content content = Content::structural;
  int label = 0;     ///< of the card
  std::string port;  ///< name of the port or stream
  std::string card;  ///< "force 5", "stream drive \"push\"": for messages
  ChannelAddress address;
  // external forces
  ChannelTiming timing;
  bool labels = false, sorted = true, accelerations = false;
  bool rotations = true;  ///< `orientation, none`: neither rotations nor moments
  bool rotate_reference_loads = true;
  int modes = 0;  ///< modal: of the joint, whether they travel or not
  // streams
  int every = 1;         ///< steps between two messages
  bool at_start = true;  ///< `send first`, `receive first`
  bool blocking = true;  ///< false: what cannot be sent at once is dropped, what is late is missed
  bool signal = true;    ///< as the card says: nothing here raises one
  bool abort_if_broken = false;
  double timeout = 0;                ///< of an input [s]; 0: none of its own
  std::vector<ChannelField> fields;  ///< empty: a float64 for each value
  int message_bytes = 0;             ///< with `fields`: padded to this size
  std::string echo;                  ///< file that keeps what crosses; empty: none
  int echo_precision = 6;
  double echo_shift = 0;  ///< added to the times of the file [s]
  std::string log_end;    ///< of its line in the .log: what crosses
  // text
  std::string user, password;  ///< that a connection must give; empty: none

  void advance(const EvalContext&, State&, bool) const override {}
};

/// All of a model, in the order of the deck.
std::vector<const DeckChannel*> deck_channels(const Model& model);

/// Line of a stream in the .log.
std::string log_line(const DeckChannel& channel);

/// `create, … , {path | local}, "…" | port, …, host, "…"`, `socket type, …` or `grpc`.
/// `default_port` 0: the card must say where; then a card that says nothing is refused.
ChannelAddress read_channel_address(Card& card, int default_port);
/// `modifier, { copy | copy cast, … }` for `count` values, when it comes.
void read_channel_modifier(Card& card, int count, DeckChannel& channel);
/// `echo, "file" [, precision, n] [, shift, s]`, when it comes.
void read_channel_echo(Card& card, DeckChannel& channel);

}  // namespace mbcosim
