/// The C++ client library against the daemon at $MBCOSIM_ADDRESS; started by test_cpp_client.py.
#include "client/mbcosim_client.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <thread>

#include "../time_factor.h"

namespace mbcosim::client {
namespace {

constexpr double kStiffness = 400;

Server connect() {
  const char* token = std::getenv("MBCOSIM_TOKEN");
  return Server::connect(std::getenv("MBCOSIM_ADDRESS"), 10, {.token = token ? token : ""});
}

/// A unit mass that starts along y with 1 m/s.
std::string body(const char* step = "1.e-3") {
  return std::string(
             "begin: data; problem: initial value; end: data; begin: initial value; initial time: "
             "0.; "
             "final time: 1.; time step: ") +
         step +
         "; method: ms, 0.6; tolerance: 1.e-9; max iterations: 20; end: initial value;"
         "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;"
         "begin: nodes; structural: 1, dynamic, null, eye, 0., 1., 0., null; end: nodes;"
         "begin: elements; body: 1, 1, 1., null, diag, 1., 1., 1.; end: elements;";
}

LoadOptions with_port() {
  LoadOptions options;
  options.ports = {{.name = "spring", .nodes = {1}}};
  return options;
}

Loads spring(const Motion& motion) {
  Loads loads;
  for (const double x : motion.x) loads.forces.push_back(-kStiffness * x);
  return loads;
}

TEST(Table, HasWhatSingleStepsGive) {
  Server server = connect();
  Simulation one = server.load_text(body()), other = server.load_text(body());
  const std::vector<std::string> names = {"node.structural.1.X", "time"};
  const Table table = one.simulate(0.1, names, {.every = 4});
  ASSERT_EQ(table.steps.size(), 26u);
  ASSERT_EQ(table.width, 4);
  EXPECT_EQ(table.columns[0].unit, "m");
  EXPECT_EQ(table.columns[1].first, 3);
  EXPECT_EQ(table.steps.back(), 100);
  EXPECT_EQ(table.result.step, 100);
  EXPECT_TRUE(table.result.ok());
  for (std::size_t i = 0; i < table.steps.size(); ++i) {
    if (i > 0) other.step(4);
    const std::vector<double> x = other.read(names[0]);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(table.row(i)[k], x[static_cast<std::size_t>(k)]);
    EXPECT_EQ(table.row(i)[3], table.times[i]);
  }
  EXPECT_EQ(one.simulate(0.2, {}, {.start = false}).steps.front(), 101);
}

/// Everything that a peer does holds whatever carries it.
class Coupled : public testing::TestWithParam<Transport> {
 protected:
  PeerOptions options() const {
    PeerOptions options;
    options.transport = GetParam();
    return options;
  }
};
INSTANTIATE_TEST_SUITE_P(Transports, Coupled,
                         testing::Values(Transport::stream, Transport::shared_memory),
                         [](const auto& info) {
                           return info.param == Transport::stream ? "Stream" : "SharedMemory";
                         });

TEST(Client, StepsReadsAndWrites) {
  Server server = connect();
  EXPECT_FALSE(server.version().empty());
  Simulation simulation = server.load_text(body());
  simulation.write("node.structural.1.load", {0, 0, 3, 0, 0, 0});
  const StepResult result = simulation.step(100);
  EXPECT_TRUE(result.ok());
  EXPECT_EQ(result.step, 100);
  // The load starts within the first step, which takes a part of it.
  EXPECT_NEAR(simulation.read("node.structural.1.XP").at(2), 0.3, 3 * 1e-3);
  EXPECT_EQ(simulation.run_until(10).outcome, Outcome::finished);
}

TEST_P(Coupled, PeerMakesAnOscillator) {
  Server server = connect();
  Simulation simulation = server.load_text(body("1.e-2"), with_port());
  PeerOptions options = this->options();
  options.mode = Mode::window;
  options.acceleration = Acceleration::iqn_ils;
  options.tolerance = 1e-10;
  const Peer peer = simulation.couple("spring", spring, options);
  const StepResult result = simulation.step(20);
  ASSERT_TRUE(result.ok()) << result.failure;
  const double omega = std::sqrt(kStiffness);
  EXPECT_NEAR(simulation.read("node.structural.1.X").at(1), std::sin(omega * result.time) / omega,
              2e-3);
  EXPECT_GE(peer.exchanges(), 20);
}

TEST_P(Coupled, SynchronousPeerGivesTheSameBits) {
  Server server = connect();
  std::vector<double> found[2];
  for (const bool synchronous : {false, true}) {
    Simulation simulation = server.load_text(body(), with_port());
    if (!synchronous) {
      const Peer peer = simulation.couple("spring", spring, options());
      ASSERT_TRUE(simulation.step(50).ok());
    } else {
      Peer peer = simulation.attach("spring", options());
      std::thread stepper([&] { EXPECT_TRUE(simulation.step(50).ok()); });
      Motion motion;
      for (int k = 0; k < 50 && peer.next(motion); ++k) peer.answer(spring(motion));
      stepper.join();
    }
    found[synchronous] = simulation.read("node.structural.1.X");
  }
  EXPECT_EQ(found[0], found[1]);
}

TEST_P(Coupled, APeerThatThrowsFailsTheStepWithItsText) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  const Peer peer = simulation.couple(
      "spring", [](const Motion&) -> Loads { throw std::runtime_error("no wind today"); },
      options());
  const StepResult result = simulation.step();
  EXPECT_EQ(result.outcome, Outcome::peer_lost);
  EXPECT_NE(result.failure.find("no wind today"), std::string::npos);
  EXPECT_EQ(result.step, 0);
}

TEST(Client, TransportsGiveTheSameBits) {
  Server server = connect();
  for (const Mode mode : {Mode::loose, Mode::staggered, Mode::tight, Mode::window}) {
    std::vector<double> found[2];
    for (const Transport transport : {Transport::stream, Transport::shared_memory}) {
      Simulation simulation = server.load_text(body("1.e-2"), with_port());
      PeerOptions options;
      options.transport = transport;
      options.mode = mode;
      const Peer peer = simulation.couple("spring", spring, options);
      ASSERT_TRUE(simulation.step(50).ok());
      found[transport == Transport::stream] = simulation.read("node.structural.1.X");
    }
    EXPECT_EQ(found[0], found[1]);
  }
}

TEST_P(Coupled, PeersHearHowImplicitStepsEnd) {
  Server server = connect();
  Simulation simulation = server.load_text(body("1.e-2"), with_port());
  PeerOptions options = this->options();
  options.mode = Mode::tight;
  std::vector<std::int64_t> accepted, rejected;
  options.step_ended = [&](bool good, std::int64_t step, double) {
    (good ? accepted : rejected).push_back(step);
  };
  int calls = 0;
  Peer peer = simulation.couple(
      "spring",
      [&](const Motion& motion) {
        if (++calls == 5) throw std::runtime_error("a gust");
        return spring(motion);
      },
      options);
  while (simulation.step().ok()) {
  }
  ASSERT_TRUE(simulation.step(10).ok());
  for (int look = 0; look < 200 && peer.exchanges() < calls; ++look)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  peer.close();
  ASSERT_EQ(rejected.size(), 1u);
  EXPECT_EQ(accepted.front(), 1);
  EXPECT_GE(accepted.size(), 10u);
}

TEST_P(Coupled, OptionsOfTheExchange) {
  Server server = connect();
  LoadOptions load;
  load.ports = {{.name = "spring", .nodes = {1}, .offsets = {0.5, 0, 0}}};
  Simulation simulation = server.load_text(body(), load);
  PeerOptions options = this->options();
  options.rotation = Rotation::quaternion;
  options.accelerations = true;
  options.every = 5;
  options.hold = Hold::linear;
  Motion seen;  // the first one
  const Peer peer = simulation.couple(
      "spring",
      [&](const Motion& motion) {
        if (seen.x.empty()) seen = motion;
        return spring(motion);
      },
      options);
  ASSERT_TRUE(simulation.step(20).ok());
  EXPECT_EQ(peer.exchanges(), 4);
  EXPECT_EQ(seen.R.size(), 4u);
  EXPECT_EQ(seen.a.size(), 3u);
  EXPECT_EQ(seen.wp.size(), 3u);
  EXPECT_EQ(seen.x.at(0), 0.5);
}

TEST(Client, ChoosesLengthsAndEnds) {
  Server server = connect();
  Simulation simulation = server.load_text(body());
  StepOptions options;
  options.step_size = 3e-3;
  const StepResult one = simulation.step(1, options);
  EXPECT_TRUE(one.ok()) << one.failure;
  EXPECT_EQ(one.time, 3e-3);
  EXPECT_EQ(one.step_size, 3e-3);
  EXPECT_GT(one.next_step_size, 0);
  EXPECT_GT(one.largest_step_size, 0);
  StepOptions exact;
  exact.exact = true;
  EXPECT_EQ(simulation.run_until(.1 / 3, exact).time, .1 / 3);
  options.step_size = -1;
  EXPECT_THROW(simulation.step(1, options), Error);
  StepOptions until;
  until.until = Condition{"node.structural.1.X", Condition::greater, .05, 1, 1e-8};
  const StepResult found = simulation.step(10000, until);
  EXPECT_TRUE(found.condition_met);
  EXPECT_NEAR(simulation.read("node.structural.1.X")[1], .05, 1e-7);
}

TEST_P(Coupled, RejectsAStepAndGetsAShorterOne) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  const Peer peer = simulation.couple(
      "spring",
      [](const Motion& motion) -> Loads {
        if (motion.target_time - motion.time > 5e-4) throw Reject{4e-4, "too long"};
        return spring(motion);
      },
      options());
  const StepResult rejected = simulation.step();
  EXPECT_EQ(rejected.outcome, Outcome::rejected_by_peer);
  EXPECT_EQ(rejected.preferred_step_size, 4e-4);
  EXPECT_NE(rejected.failure.find("too long"), std::string::npos) << rejected.failure;
  EXPECT_EQ(rejected.step, 0);
  StepOptions shorter;
  shorter.step_size = rejected.preferred_step_size;
  EXPECT_EQ(simulation.step(1, shorter).time, 4e-4);
}

TEST_P(Coupled, ALateOrDeadPeerIsGivenUpInItsTime) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  PeerOptions options = this->options();
  options.peer_timeout = 0.3;
  const auto start = std::chrono::steady_clock::now();
  {
    Peer silent = simulation.attach("spring", options);
    const StepResult result = simulation.step();
    EXPECT_EQ(result.outcome, Outcome::peer_lost);
    EXPECT_NE(result.failure.find("in time"), std::string::npos) << result.failure;
  }
  const StepResult alone = simulation.step();
  EXPECT_EQ(alone.outcome, Outcome::peer_lost);
  EXPECT_LT(std::chrono::steady_clock::now() - start, mbcosim::stretched(3));
  const Peer again = simulation.couple("spring", spring, this->options());
  EXPECT_TRUE(simulation.step(3).ok());
}

TEST_P(Coupled, RefusalsTellWhatIsWrong) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  const auto refused = [&](const std::string& port, const PeerOptions& options) {
    try {
      simulation.attach(port, options);
    } catch (const Error& error) {
      return error.reason();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused("wing", options()), "NO_SUCH_PORT");
  PeerOptions wrong = options();
  wrong.frame = Frame::reference;
  EXPECT_EQ(refused("spring", wrong), "PORT_MISMATCH");
  const Peer first = simulation.attach("spring", options());
  EXPECT_EQ(refused("spring", options()), "PORT_TAKEN");
}

TEST_P(Coupled, AnAnswerOfTheWrongLengthEndsThePeer) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  Peer peer = simulation.attach("spring", options());
  std::thread stepper([&] { EXPECT_EQ(simulation.step().outcome, Outcome::peer_lost); });
  Motion motion;
  ASSERT_TRUE(peer.next(motion));
  peer.answer(Loads{.forces = {1, 2}});
  EXPECT_FALSE(peer.next(motion));
  stepper.join();
  EXPECT_EQ(simulation.step(0).step, 0);
}

TEST_P(Coupled, DerivativesSaveIterations) {
  Server server = connect();
  std::int64_t exchanges[2];
  std::vector<double> found[2];
  for (const bool with_tangent : {false, true}) {
    Simulation simulation = server.load_text(body("1.e-2"), with_port());
    PeerOptions options = this->options();
    options.mode = Mode::tight;
    options.tolerance = 1e-12;
    if (with_tangent) options.tangent = Tangent::block_diagonal;
    const auto answer = [&](const Motion& motion) {
      Loads loads = spring(motion);
      if (!with_tangent) return loads;
      loads.stiffness.assign(36, 0.0);
      for (std::size_t i = 0; i < 3; ++i) loads.stiffness[7 * i] = -kStiffness;
      return loads;
    };
    const Peer peer = simulation.couple("spring", answer, options);
    ASSERT_TRUE(simulation.step(20).ok());
    exchanges[with_tangent] = peer.exchanges();
    found[with_tangent] = simulation.read("node.structural.1.X");
  }
  EXPECT_LT(exchanges[true], exchanges[false]);
  EXPECT_NEAR(found[true].at(1), found[false].at(1), 1e-9);
}

TEST_P(Coupled, MotionIsImposed) {
  Server server = connect();
  LoadOptions load;
  load.ports = {{.name = "hand", .nodes = {1}, .kind = PortKind::motion, .positions_only = true}};
  Simulation simulation = server.load_text(body(), load);
  const auto hand = [](const Motion& motion) {
    EXPECT_EQ(motion.forces.size(), 3u);
    return Loads{.positions = {0, motion.target_time, 0}};
  };
  const Peer peer = simulation.couple("hand", hand, options());
  const StepResult result = simulation.step(20);
  ASSERT_TRUE(result.ok()) << result.failure;
  EXPECT_NEAR(simulation.read("node.structural.1.X").at(1), 0.02, 1e-9);
}

TEST_P(Coupled, HeartbeatsKeepASlowPeerAlive) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  PeerOptions options = this->options();
  options.heartbeat_timeout = 0.9;
  const auto slow = [](const Motion& motion) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    return spring(motion);
  };
  const Peer peer = simulation.couple("spring", slow, options);
  const StepResult result = simulation.step();
  EXPECT_TRUE(result.ok()) << result.failure;
}

TEST_P(Coupled, ASilentServerEndsThePeerThatWantsSignsOfLife) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  PeerOptions options = this->options();
  options.server_timeout = 0.3;
  Peer peer = simulation.attach("spring", options);
  const auto step = [&] {
    std::this_thread::sleep_for(std::chrono::seconds(1));  // longer than the limit
    EXPECT_TRUE(simulation.step().ok());
  };
  std::thread stepper(step);
  Motion motion;
  EXPECT_TRUE(peer.next(motion)) << "the server gave no signs of life";
  peer.answer(spring(motion));
  stepper.join();
}

TEST_P(Coupled, SignalsOfManyNumbers) {
  constexpr int kNumbers =
      65536;  // twice as many go out: more than the shared memory holds at once
  Server server = connect();
  std::string deck = body();
  deck.replace(deck.find("begin: elements"), 0,
               "begin: drivers; file: 7, stream, name, \"wide\", create, yes, " +
                   std::to_string(kNumbers) + "; end: drivers;");
  deck.replace(deck.find("rigid bodies"), 0, "file drivers: 1; ");
  LoadOptions load;
  load.ports = {
      {.name = "loop", .outputs = {"stream.wide", "stream.wide"}, .inputs = {"stream.wide"}}};
  Simulation simulation = server.load_text(deck, load);
  const Peer peer = simulation.couple(
      "loop",
      [](const Motion& motion) {
        Loads loads;
        EXPECT_EQ(motion.signals.size(), std::size_t{2 * kNumbers});
        loads.signals.assign(motion.signals.begin(), motion.signals.begin() + kNumbers);
        for (std::size_t i = 0; i < loads.signals.size(); ++i) loads.signals[i] += double(i);
        return loads;
      },
      options());
  const StepResult result = simulation.step(3);
  ASSERT_TRUE(result.ok()) << result.failure;
  const std::vector<double> numbers = simulation.read("stream.wide");
  ASSERT_EQ(numbers.size(), std::size_t{kNumbers});
  EXPECT_EQ(numbers.back(), 3.0 * (kNumbers - 1));
}

TEST(Client, APeerMayBelongToAnotherClient) {
  Server server = connect(), other = connect();
  Simulation simulation = server.load_text(body(), with_port());
  {
    Simulation same = other.find(simulation.name());
    const Peer peer = same.couple("spring", spring);
    EXPECT_TRUE(simulation.step(3).ok());
    EXPECT_EQ(same.read("time"), simulation.read("time"));
  }
  EXPECT_EQ(simulation.read("node.structural.1.X").size(), 3u);  // not deleted by the other
  EXPECT_THROW(other.find("simulations/none"), Error);
}

TEST(Client, ErrorsCarryTheServersDetails) {
  Server server = connect();
  try {
    server.load_text("begin: data; problm: initial value; end: data;");
    FAIL() << "the deck was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), 3);
    EXPECT_EQ(error.reason(), "DECK_ERROR");
    EXPECT_NE(std::string(error.what()).find("deck:1:"), std::string::npos) << error.what();
  }
  Simulation simulation = server.load_text(body());
  try {
    simulation.couple("wing", spring);
    FAIL() << "there is no such port";
  } catch (const Error& error) {
    EXPECT_EQ(error.reason(), "NO_SUCH_PORT");
  }
  EXPECT_THROW(simulation.read("nothing"), Error);
  EXPECT_THROW(Server::connect("unix:/nonexistent/socket", 0.3), Error);
}

TEST(Client, UploadsIncludedFiles) {
  const std::string folder = testing::TempDir();
  std::ofstream(folder + "main.mbd") << "include: \"rest.mbd\";";
  std::ofstream(folder + "rest.mbd") << body();
  Server server = connect();
  EXPECT_TRUE(server.load(folder + "main.mbd").step().ok());
}

/// Stops the daemon while it lives.
class Stopped {
 public:
  Stopped() { ::kill(pid(), SIGSTOP); }
  ~Stopped() { ::kill(pid(), SIGCONT); }
  static pid_t pid() { return static_cast<pid_t>(std::atoi(std::getenv("MBCOSIM_PID"))); }
};

double seconds_of(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  const auto end = std::chrono::steady_clock::now();
  return std::chrono::duration<double>(end - begin).count();
}

/// The code with which `call` fails; 0: it does not.
int code_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.code();
  }
  return 0;
}

TEST(AStoppedServer, EndsEveryCallAtItsTimeout) {
  if (!std::getenv("MBCOSIM_PID")) GTEST_SKIP() << "only with a daemon of its own";
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  const std::string x = "node.structural.1.X", load = "node.structural.1.load";
  const std::vector<std::pair<const char*, std::function<void()>>> calls = {
      {"version", [&] { server.version(0.3); }},
      {"load", [&] { server.load_text(body(), {.timeout = 0.3}); }},
      {"find", [&] { server.find(simulation.name(), 0.3); }},
      {"step", [&] { simulation.step(1, {.timeout = 0.3}); }},
      {"run_until", [&] { simulation.run_until(1, {.timeout = 0.3}); }},
      {"read", [&] { simulation.read(x, 0.3); }},
      {"write", [&] { simulation.write(load, std::vector<double>(6), 0.3); }},
      {"interrupt", [&] { simulation.interrupt(0.3); }},
      {"attach", [&] { simulation.attach("spring", {.timeout = 0.3}); }},
  };
  const Stopped stopped;
  for (const auto& [name, call] : calls) {
    int code = 0;
    EXPECT_LT(seconds_of([&, &c = call] { code = code_of(c); }), 0.3 + 2 * time_factor()) << name;
    EXPECT_EQ(code, 4) << name;
  }
  EXPECT_LT(seconds_of([&] { Simulation(std::move(simulation)); }), 2 + 2 * time_factor());
}

TEST(AStoppedServer, IsNoticedInAStepWithoutATimeout) {
  if (!std::getenv("MBCOSIM_PID")) GTEST_SKIP() << "only with a daemon of its own";
  Server server = connect();
  Simulation simulation = server.load_text(body());
  const Stopped stopped;
  int code = 0;
  EXPECT_LT(seconds_of([&] { code = code_of([&] { simulation.step(); }); }),
            25 + 2 * time_factor());
  EXPECT_EQ(code, 14);
}

}  // namespace
}  // namespace mbcosim::client
