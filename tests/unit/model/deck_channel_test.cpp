#include "model/deck_channel.h"

#include <gtest/gtest.h>

#include "deck_run.h"
#include "output/model_log.h"

namespace mbcosim::deck_channel_test {
namespace {

std::string deck(const std::string& counts, const std::string& drivers, const std::string& cards) {
  return "begin: data; problem: initial value; end: data; begin: initial value; initial time: 0.; "
         "final time: 1.; time step: 1e-2; end: initial value; begin: control data; "
         "structural nodes: 1; rigid bodies: 1; " +
         counts +
         " end: control data; begin: nodes; structural: 1, dynamic, null, eye, null, null; end: "
         "nodes; " +
         drivers + " begin: elements; body: 1, 1, 1., null, eye; " + cards + " end: elements;";
}

TEST(DeckChannel, KeepsWhatTheCardOfAForceSays) {
  DeckRun run(deck("forces: 1;", "",
                   "force: 5, external structural, socket, create, yes, port, 7001, host, \"h\", "
                   "coupling, 3, reference node, 1, labels, yes, sorted, no, orientation, none, "
                   "use reference node forces, yes, rotate reference node forces, no, 1, 1;"));
  ASSERT_TRUE(run.ready());
  const auto channels = deck_channels(run.model());
  ASSERT_EQ(channels.size(), 1u);
  const DeckChannel& c = *channels[0];
  EXPECT_EQ(c.content, DeckChannel::Content::structural);
  EXPECT_EQ(c.port, "external5");
  EXPECT_EQ(c.card, "force 5");
  EXPECT_EQ(c.address.kind, ChannelAddress::Kind::tcp);
  EXPECT_TRUE(c.address.create);
  EXPECT_EQ(c.address.host + ":" + std::to_string(c.address.port), "h:7001");
  EXPECT_EQ(c.timing.coupling, PortCoupling::tight);
  EXPECT_EQ(c.timing.every, 3);
  EXPECT_TRUE(c.labels);
  EXPECT_FALSE(c.sorted);
  EXPECT_FALSE(c.rotations);
  EXPECT_FALSE(c.rotate_reference_loads);
}

TEST(DeckChannel, FilesAreCommunicators) {
  DeckRun run(
      deck("forces: 1;", "",
           "force: 5, external structural, \"in\", unlink, \"out\", no clobber, sleep time, "
           ".5, precision, 9, coupling, staggered, 1, 1;"));
  ASSERT_TRUE(run.ready());
  const DeckChannel& c = *deck_channels(run.model()).at(0);
  EXPECT_EQ(c.address.kind, ChannelAddress::Kind::files);
  EXPECT_EQ(c.address.in + " " + c.address.out, "in out");
  EXPECT_TRUE(c.address.unlink && c.address.no_clobber);
  EXPECT_EQ(c.address.sleep_time, 0.5);
  EXPECT_EQ(c.address.precision, 9);
  EXPECT_FALSE(c.timing.send_after_predict);
}

TEST(DeckChannel, StreamsHaveDefaultPortsAndFields) {
  DeckRun run(
      deck("output elements: 1; file drivers: 1;",
           "begin: drivers; file: 1, stream, name, \"i\", create, yes, input every, 2, receive "
           "first, no, "
           "timeout, 3., 2, modifier, copy cast, swap, int16_t, skip, 1, int16_t, skip, 2, "
           "float, skip, 3; end: drivers;",
           "stream output: 9, stream name, \"o\", no send first, non blocking, abort if broken, "
           "output every, 4, echo, \"e\", precision, 8, values, 1, drive, time;"));
  ASSERT_TRUE(run.ready());
  const auto channels = deck_channels(run.model());
  ASSERT_EQ(channels.size(), 2u);
  const DeckChannel &in = *channels[0], &out = *channels[1];
  EXPECT_EQ(in.address.port, 9012);
  EXPECT_EQ(in.every, 2);
  EXPECT_FALSE(in.at_start);
  EXPECT_EQ(in.timeout, 3);
  ASSERT_EQ(in.fields.size(), 2u);
  EXPECT_EQ(in.fields[0].type, ChannelField::Type::int16);
  EXPECT_TRUE(in.fields[0].swapped);
  EXPECT_FALSE(in.fields[1].swapped);
  EXPECT_EQ(in.fields[1].skip, 2);
  EXPECT_EQ(in.message_bytes, 1 + 2 + 2 + 4 + 3);
  EXPECT_EQ(out.address.port, 9011);
  EXPECT_FALSE(out.at_start || out.blocking);
  EXPECT_TRUE(out.abort_if_broken);
  EXPECT_EQ(out.every, 4);
  EXPECT_EQ(out.echo, "e");
  EXPECT_EQ(out.echo_precision, 8);
}

TEST(DeckChannel, LinesOfTheLogSayWhatTheCardsSay) {
  DeckRun run(deck("output elements: 2; file drivers: 2;",
                   "begin: drivers; file: 3, stream, name, \"i\", create, yes, no signal, non "
                   "blocking, input every, 2, receive first, no, timeout, 1.5, 2, initial values, "
                   "3., 4.5; file: 4, stream, name, \"p\", grpc, 1; end: drivers;",
                   "stream output: 9, stream name, \"o\", port, 7001, host, \"h\", socket type, "
                   "udp, no send first, non blocking, abort if broken, output every, 4, values, 1, "
                   "drive, time; stream motion output: 10, stream name, \"m\", create, yes, path, "
                   "\"s\", motion, output flags, position, velocity, 1;"));
  ASSERT_TRUE(run.ready());
  const auto channels = deck_channels(run.model());
  ASSERT_EQ(channels.size(), 3u);
  EXPECT_EQ(channels[0]->label, 3);
  EXPECT_EQ(channels[1]->label, 9);
  const std::string text = model_log(run.model());
  for (const char* line :
       {"\nfiledriver: 3 stream INET i 127.0.0.1 9012 tcp 1 0 1 2 0 1.5 2 3 4.5\n",
        "\noutputelement: 9 stream INET o h 7001 udp 0 1 0 0 1 4 values 1\n",
        "\noutputelement: 10 stream UNIX m s tcp 1 1 1 1 0 1 motion 1 0 0 1 0 1\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "is not in\n" << text;
  EXPECT_EQ(text.find("filedriver: 4"), std::string::npos) << "a port of the daemon has no address";
}

TEST(DeckChannel, PortsOfTheDaemonAreNone) {
  DeckRun run(deck("forces: 1; output elements: 1; file drivers: 1;",
                   "begin: drivers; file: 1, stream, name, \"i\", grpc, 1; end: drivers;",
                   "force: 5, external structural, grpc, port, \"p\", 1, 1; "
                   "stream output: 9, stream name, \"o\", grpc, values, 1, drive, time;"));
  ASSERT_TRUE(run.ready());
  EXPECT_TRUE(deck_channels(run.model()).empty());
}

}  // namespace
}  // namespace mbcosim::deck_channel_test
