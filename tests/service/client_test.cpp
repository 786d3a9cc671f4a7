/// The C++ client library against the daemon at $MBCOSIM_ADDRESS; started by test_cpp_client.py.
#include "client/mbcosim_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "../time_factor.h"

namespace mbcosim::client::client_test {
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

/// It never comes to its end.
std::string endless() {
  std::string deck = body();
  const std::string from = "final time: 1.";
  return deck.replace(deck.find(from), from.size(), "final time: 1.e9");
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

TEST(ClientAddress, ThatIsNoneIsRefusedAndNobodysIsToldWhy) {
  const std::string long_path = "unix:/" + std::string(200, 'x');
  for (const auto& [address, told] : std::initializer_list<std::pair<std::string, const char*>>{
           {"foo", "expected unix:PATH or HOST:PORT"},
           {"http://localhost:1", "the address of a page"},
           {"/tmp/s", "a path without `unix:`"},
           {"localhost:0", "a number from 1 to 65535"},
           {"localhost:x", "a number from 1 to 65535"},
           {":1", "expected unix:PATH or HOST:PORT"},
           {"unix:", "names no socket"},
           {"unix:/tmp/a,b", "a comma in the path of a socket"},
           {long_path, "at most 107 bytes"}}) {
    try {
      (void)Server::connect(address, 30);
      ADD_FAILURE() << address;
    } catch (const Error& error) {
      EXPECT_EQ(error.reason(), "BAD_ARGUMENT");
      EXPECT_NE(std::string(error.what()).find(told), std::string::npos) << error.what();
    }
  }
  const std::string folder = testing::TempDir(), file = folder + "/mbcosim_no_socket";
  std::ofstream(file) << "text";
  for (const auto& [path, told] :
       {std::pair(folder + "/mbcosim_nothing", "there is no such socket"),
        std::pair(file, "that is no socket")}) {
    try {
      (void)Server::connect("unix:" + path, 0.2);
      ADD_FAILURE() << path;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(told), std::string::npos) << error.what();
    }
  }
  std::remove(file.c_str());
}

// gRPC would abort the process.
TEST(ClientAddress, TokensAndNamesThatNoCallCanCarryAreRefused) {
  for (const char* token : {"caf\xc3\xa9", "a\tb", "a\nb", "a\x7f"}) {
    try {
      (void)Server::connect(std::getenv("MBCOSIM_ADDRESS"), 10, {.token = token});
      ADD_FAILURE() << token;
    } catch (const Error& error) {
      EXPECT_EQ(error.reason(), "BAD_ARGUMENT");
      EXPECT_EQ(std::string(error.what()).find(token), std::string::npos) << "it is a secret";
    }
  }
  Server server = connect();
  for (const char* name : {"simulations/caf\xc3\xa9", "simulations/a\nb", "\xff"}) {
    try {
      (void)server.find(name);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.reason(), "NO_SUCH_SIMULATION");
    }
  }
}

TEST(Table, HasWhatSingleStepsGive) {
  Server server = connect();
  Simulation one = server.load_text(body()), other = server.load_text(body());
  const std::vector<std::string> names = {"node.structural.1.X", "time"};
  const Table table = one.simulate(0.1, names, {.every = 4});
  ASSERT_EQ(table.steps.size(), 26u);
  ASSERT_EQ(table.width, 4);
  EXPECT_EQ(table.columns[0].unit, "deck unit of length");
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
  std::atomic<int> calls = 0;
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

TEST_P(Coupled, AThrowingStepEndedEndsThePeerAndNotTheProgram) {
  Server server = connect();
  Simulation simulation = server.load_text(body("1.e-2"), with_port());
  PeerOptions options = this->options();
  options.mode = Mode::tight;
  options.step_ended = [](bool, std::int64_t, double) {
    throw std::runtime_error("the log is full");
  };
  const Peer peer = simulation.couple("spring", spring, options);
  EXPECT_FALSE(simulation.step(1000).ok());  // it takes part in one, or in few
  for (int look = 0; look < 3000 && !peer.error(); ++look)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_TRUE(peer.error());
  EXPECT_STREQ(peer.error()->what(), "the peer's own code failed: the log is full");
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

/// Port "wing" of body 1, counted from node 0, which turns and accelerates: its body's center of
/// mass lies beside it.
std::string with_reference_node() {
  return "begin: data; problem: initial value; end: data; begin: initial value; initial time: 0.; "
         "final time: 1.; time step: 1.e-2; tolerance: 1.e-9; max iterations: 20; derivatives "
         "tolerance: 1.e-4; derivatives max iterations: 20; end: initial value; begin: control "
         "data; structural nodes: 2; rigid bodies: 2; forces: 1; end: control data; begin: nodes; "
         "structural: 0, dynamic, 2., -1., 1.5, euler123, .2, .3, -.1, .5, .6, .7, 1., 2., 3.; "
         "structural: 1, dynamic, 1., 2., 3., eye, 0., 1., 0., null; end: nodes; begin: elements; "
         "body: 0, 0, 1., .1, .2, .3, diag, 1., 2., 3.; body: 1, 1, 1., null, eye; "
         "force: 5, external structural, grpc, port, \"wing\", reference node, 0, use "
         "reference node forces, no, 1, 1, offset, null; end: elements;";
}

Motion::Reference read_reference(const Simulation& simulation) {
  const auto read = [&](const char* what) {
    return simulation.read(std::string("node.structural.0.") + what);
  };
  return {read("X"), read("R"), read("XP"), read("Omega"), read("XPP"), read("OmegaP")};
}

/// Motions of the exchanges of steps one by one, and what the simulation told before each.
struct Told {
  std::vector<Motion> motions;
  std::vector<Motion::Reference> references;
  std::vector<std::vector<double>> points;  ///< positions of node 1
};

Told tell_reference(Server& server, const PeerOptions& options) {
  Simulation simulation = server.load_text(with_reference_node());
  Told told;
  const auto answer = [&](const Motion& motion) {
    told.motions.push_back(motion);
    return Loads{.forces = {1, 2, 3}};
  };
  const Peer peer = simulation.couple("wing", answer, options);
  EXPECT_EQ(peer.layout().reference_node, std::optional<int>(0));
  for (int k = 0; k < 3; ++k) {
    told.references.push_back(read_reference(simulation));
    told.points.push_back(simulation.read("node.structural.1.X"));
    const StepResult result = simulation.step();
    EXPECT_TRUE(result.ok()) << result.failure;
  }
  return told;
}

std::vector<double> matrix_of(const std::vector<double>& quaternion) {
  const double w = quaternion.at(0), x = quaternion.at(1), y = quaternion.at(2),
               z = quaternion.at(3);
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

/// Position in the frame of the reference node.
std::vector<double> seen_from(const Motion::Reference& r, const std::vector<double>& x) {
  std::vector<double> seen(3);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) seen[i] += r.R.at(3 * k + i) * (x.at(k) - r.x.at(k));
  return seen;
}

void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-12);
}

TEST_P(Coupled, TheMotionOfAReferenceNodeIsToldInTheGlobalFrame) {
  Server server = connect();
  PeerOptions options = this->options();
  options.mode = Mode::loose;
  options.accelerations = true;
  for (const Frame frame : {Frame::global, Frame::reference})
    for (const Rotation rotation : {Rotation::matrix, Rotation::quaternion}) {
      options.frame = frame;
      options.rotation = rotation;
      const Told told = tell_reference(server, options);
      ASSERT_EQ(told.motions.size(), told.references.size());
      for (std::size_t k = 0; k < told.motions.size(); ++k) {
        const Motion::Reference &found = told.motions[k].reference, &expected = told.references[k];
        EXPECT_EQ(found.x, expected.x);
        EXPECT_EQ(found.v, expected.v);
        EXPECT_EQ(found.w, expected.w);
        EXPECT_EQ(found.a, expected.a);
        EXPECT_EQ(found.wp, expected.wp);
        expect_near(rotation == Rotation::matrix ? found.R : matrix_of(found.R), expected.R);
        const std::vector<double>& point = told.points[k];
        expect_near(told.motions[k].x,
                    frame == Frame::reference ? seen_from(expected, point) : point);
      }
      EXPECT_NE(told.references.front().a, std::vector<double>(3)) << "the node accelerates";
      EXPECT_NE(told.references.front().wp, std::vector<double>(3));
    }
}

TEST_P(Coupled, OfAReferenceNodeNothingIsToldThatWasNotAgreedOn) {
  Server server = connect();
  const Told told = tell_reference(server, options());
  ASSERT_FALSE(told.motions.empty());
  EXPECT_EQ(told.motions.front().reference.x.size(), 3u);
  EXPECT_TRUE(told.motions.front().reference.a.empty());
  EXPECT_TRUE(told.motions.front().reference.wp.empty());
}

TEST_P(Coupled, APortWithoutAReferenceNodeTellsNone) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  PeerOptions options = this->options();
  options.accelerations = true;
  Motion seen;
  const auto answer = [&](const Motion& motion) {
    seen = motion;
    return spring(motion);
  };
  {
    const Peer peer = simulation.couple("spring", answer, options);
    EXPECT_FALSE(peer.layout().reference_node);
    ASSERT_TRUE(simulation.step().ok());
  }
  ASSERT_EQ(seen.a.size(), 3u);
  const Motion::Reference& none = seen.reference;
  for (const auto& numbers : {none.x, none.R, none.v, none.w, none.a, none.wp})
    EXPECT_TRUE(numbers.empty());
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

TEST(Client, SavesRestoresAndBranches) {
  Server server = connect();
  Simulation simulation = server.load_text(body());
  simulation.step(5);
  const Snapshot saved = simulation.snapshot("five");
  EXPECT_EQ(saved.step, 5);
  const std::string bytes = simulation.export_state(saved);
  simulation.step(5);
  const std::vector<double> later = simulation.read("node.structural.1.X");
  simulation.restore(saved);
  EXPECT_EQ(simulation.refresh().step, 5);
  simulation.step(5);
  EXPECT_EQ(simulation.read("node.structural.1.X"), later);
  Simulation branch = simulation.fork(saved, {.display_name = "branch"});
  EXPECT_EQ(branch.refresh().display_name, "branch");
  branch.step(5);
  EXPECT_EQ(branch.read("node.structural.1.X"), later);
  branch.import_state(bytes);
  EXPECT_EQ(branch.refresh().step, 5);
  EXPECT_EQ(branch.export_state(), bytes);
  EXPECT_EQ(simulation.snapshots().size(), 1u);
  simulation.delete_snapshot(saved);
  EXPECT_TRUE(simulation.snapshots().empty());
  simulation.reset();
  EXPECT_EQ(simulation.refresh().step, 0);
}

TEST(Client, LinearizesInBothForms) {
  Server server = connect();
  const Simulation simulation = server.load_text(body());
  const LinearModel system =
      simulation.linearize({"node.structural.1.load"}, {"node.structural.1.X"});
  EXPECT_EQ(system.A.rows, system.A.columns);
  EXPECT_EQ(system.B.columns, 6);
  EXPECT_EQ(system.C.rows, 3);
  const LinearModel whole = simulation.linearize_descriptor();
  EXPECT_TRUE(whole.E.sparse);
  EXPECT_EQ(whole.A.rows, static_cast<int>(whole.state_names.size()));
  EXPECT_EQ(whole.A.values.size(), whole.A.row_indices.size());
  const Spectrum spectrum = simulation.eigenvalues(2, 1.0, true);
  ASSERT_EQ(spectrum.values.size(), 2u);
  EXPECT_EQ(spectrum.vectors.size(), 2 * whole.state_names.size());
}

TEST(Client, SamplesComeWhoeverAdvances) {
  Server server = connect();
  Simulation simulation = server.load_text(body());
  Subscription samples = simulation.subscribe({"time", "node.structural.1.X"}, {.every = 2});
  simulation.step(10);
  Sample sample;
  for (std::int64_t step = 2; step <= 10; step += 2) {
    ASSERT_TRUE(samples.next(sample));
    EXPECT_EQ(sample.step, step);
    EXPECT_EQ(sample.values.size(), 4u);
    EXPECT_EQ(sample.values[0], sample.time);
  }
  EXPECT_EQ(samples.dropped(), 0);
  samples.close();
  EXPECT_FALSE(samples.next(sample));
}

TEST(Client, AStreamCarriesInputsAndOutputsInOneMessage) {
  Server server = connect();
  Simulation simulation = server.load_text(body()), other = server.load_text(body());
  Stepper stepper = simulation.stepper({"node.structural.1.X"}, {"node.structural.1.load"});
  StepOptions options;
  options.outputs = {"node.structural.1.X"};
  for (int k = 1; k <= 20; ++k) {
    const double force = 0.1 * k;
    options.inputs = {{"node.structural.1.load", {0, 0, force, 0, 0, 0}}};
    const StepResult one = stepper.step({0, 0, force, 0, 0, 0}), same = other.step(1, options);
    EXPECT_EQ(one.step, k);
    EXPECT_EQ(one.values.at("node.structural.1.X"), same.values.at("node.structural.1.X"));
  }
  EXPECT_THROW(stepper.step({1, 2}), Error);
  EXPECT_THROW(stepper.step({0, 0, 0, 0, 0, 0}), Error);
}

TEST(Client, SteppersOfManySimulationsShareAStream) {
  constexpr std::size_t kMany = 5;
  Server server = connect();
  const std::string x = "node.structural.1.X", load = "node.structural.1.load";
  std::vector<Simulation> shared, alone;
  std::vector<Stepper> steppers;
  for (std::size_t k = 0; k < kMany; ++k) {
    shared.push_back(server.load_text(body()));
    alone.push_back(server.load_text(body()));
    steppers.push_back(k == 0 ? shared[0].stepper({x}, {load})
                              : shared[k].stepper(steppers[0], {x}, {load}));
  }
  for (int step = 1; step <= 20; ++step)
    for (std::size_t k = 0; k < kMany; ++k) {
      const std::vector<double> force = {0, 0, 0.1 * step + double(k), 0, 0, 0};
      const StepResult one = steppers[k].step(force),
                       same = alone[k].step(1, {.inputs = {{load, force}}, .outputs = {x}});
      EXPECT_EQ(one.step, step);
      EXPECT_EQ(one.values.at(x), same.values.at(x));
    }
  // One that has ended leaves the others another stream.
  EXPECT_THROW(steppers[1].step({1, 2}), Error);
  EXPECT_THROW(steppers[1].step(std::vector<double>(6)), Error);
  steppers[0].close();
  for (std::size_t k = 2; k < kMany; ++k)
    EXPECT_EQ(steppers[k].step(std::vector<double>(6)).step, 21);
  steppers.push_back(shared[1].stepper(steppers[2], {x}));
  EXPECT_EQ(steppers.back().step().step, 21) << "nothing of the refused step was done";

  const auto field = [&](const std::function<void()>& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("nothing is refused");
  };
  EXPECT_EQ(field([&] { shared[1].stepper(steppers[1]); }), "beside") << "it is over";
  Server another = connect();
  Simulation found = another.find(shared[0].name());
  EXPECT_EQ(field([&] { found.stepper(steppers[2]); }), "beside") << "of another connection";
}

TEST(Client, ThreadsTakeTurnsOnASharedStream) {
  constexpr std::size_t kThreads = 4;
  Server server = connect();
  std::vector<Simulation> simulations;
  std::vector<Stepper> steppers;
  for (std::size_t k = 0; k < kThreads; ++k) {
    simulations.push_back(server.load_text(endless()));
    steppers.push_back(k == 0 ? simulations[0].stepper({"time"})
                              : simulations[k].stepper(steppers[0], {"time"}));
  }
  std::vector<std::thread> threads;
  for (Stepper& stepper : steppers)
    threads.emplace_back([&stepper] {
      for (int step = 1; step <= 200; ++step) {
        const StepResult result = stepper.step();
        EXPECT_EQ(result.step, step);
        EXPECT_NEAR(result.values.at("time").at(0), 1e-3 * step, 1e-9);
      }
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(Client, TheTurnOfAnotherStepperIsAwaitedForTheTimeout) {
  Server server = connect();
  Simulation slow = server.load_text(endless()), quick = server.load_text(body());
  Stepper first = slow.stepper();
  Stepper second = quick.stepper(first);
  std::atomic<bool> interrupted{false};
  std::thread thread(
      [&] { interrupted = first.step({}, 1000000000).outcome == Outcome::interrupted; });
  while (slow.refresh().step == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  try {
    second.step({}, 1, {}, 0.1);
    ADD_FAILURE() << "two steps at once on one stream";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), 4) << error.what();  // DEADLINE_EXCEEDED
  }
  EXPECT_TRUE(slow.interrupt());
  thread.join();
  EXPECT_TRUE(interrupted) << "the other's step goes on";
  EXPECT_EQ(quick.refresh().step, 0);
}

TEST(Client, QuickStepsAreThoseOfAStream) {
  Server server = connect();
  const std::string x = "node.structural.1.X", load = "node.structural.1.load";
  Simulation simulation = server.load_text(body()), other = server.load_text(body());
  Stepper stepper = other.stepper({x}, {load});
  for (int k = 1; k <= 50; ++k) {
    const std::vector<double> force = {0, 0, 0.1 * k, 0, 0, 0};
    const StepResult one = simulation.step(1, {.inputs = {{load, force}}, .outputs = {x}});
    EXPECT_EQ(one.step, k);
    EXPECT_EQ(one.values, stepper.step(force).values);
    if (k % 10 == 0) {  // what a stream refuses is told as by a call, and nothing of it is done
      try {
        simulation.step(-1);
        ADD_FAILURE() << "fewer steps than none";
      } catch (const Error& error) {
        EXPECT_EQ(error.field(), "steps") << error.what();
      }
    }
  }
  EXPECT_EQ(simulation.run_until(0.1).step, 100);
  EXPECT_EQ(simulation.refresh().step, 100);
}

TEST(Client, ThreadsStepSimulationsOfOneConnection) {
  constexpr int kThreads = 20, kSteps = 100;  // more than there are streams
  Server server = connect();
  std::vector<Simulation> simulations;
  for (int k = 0; k < kThreads; ++k) simulations.push_back(server.load_text(endless()));
  std::vector<std::thread> threads;
  for (Simulation& simulation : simulations)
    threads.emplace_back([&simulation] {
      for (int k = 1; k <= kSteps; ++k) EXPECT_EQ(simulation.step().step, k);
    });
  for (std::thread& thread : threads) thread.join();
  for (Simulation& simulation : simulations) EXPECT_EQ(simulation.refresh().step, kSteps);
}

TEST(Client, QuickStepsDoNotKeepASimulationAlive) {
  Server server = connect();
  LoadOptions options;
  options.lease = time_factor();
  Simulation simulation = server.load_text(endless(), options);
  for (int k = 0; k < 100; ++k) simulation.step();
  const auto is_there = [&] {
    const std::vector<SimulationInfo> all = server.list();
    return std::any_of(all.begin(), all.end(),
                       [&](const SimulationInfo& info) { return info.name == simulation.name(); });
  };
  EXPECT_TRUE(is_there());
  const auto latest = std::chrono::steady_clock::now() + stretched(60);
  while (is_there() && std::chrono::steady_clock::now() < latest)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(is_there()) << "its lease is over";
  EXPECT_THROW(simulation.step(), Error);
}

TEST(ABalancer, LeadsEveryStepToTheDaemonOfItsSimulation) {
  if (!std::getenv("MBCOSIM_BALANCED")) GTEST_SKIP() << "only with several daemons";
  Server server = connect();
  std::vector<Simulation> simulations;
  for (int k = 0; k < 6; ++k) simulations.push_back(server.load_text(endless()));
  for (int k = 1; k <= 100; ++k)
    for (Simulation& simulation : simulations) EXPECT_EQ(simulation.step().step, k);
  std::vector<Stepper> steppers;
  for (Simulation& simulation : simulations) steppers.push_back(simulation.stepper());
  for (int k = 101; k <= 120; ++k)
    for (Stepper& stepper : steppers) EXPECT_EQ(stepper.step().step, k);
}

TEST(Client, OptionsOfTheSimulation) {
  Server server = connect();
  LoadOptions options;
  options.display_name = "mass";
  options.policy = NonConvergence::cut_step;
  options.lease = 30;
  options.symbols = {{"m", 4.0}};
  options.grants = {{.identity = "*", .right = Grant::observe}};
  std::string deck = body();
  deck.insert(0, "set: real m = 1.; remark: \"a word\", m; ");
  deck.replace(deck.find("body: 1, 1, 1."), 14, "body: 1, 1, m");
  Simulation simulation = server.load_text(deck, options);
  simulation.write("node.structural.1.load", {0, 0, 4, 0, 0, 0});
  simulation.step(1000);
  EXPECT_NEAR(simulation.read("node.structural.1.XP").at(2), 1, 1e-2);
  EXPECT_EQ(simulation.update({.display_name = "renamed"}).display_name, "renamed");
  bool listed = false;
  for (const SimulationInfo& info : server.list()) listed |= info.name == simulation.name();
  EXPECT_TRUE(listed);
  EXPECT_FALSE(simulation.interrupt());
  bool found = false;
  for (const Variable& v : simulation.variables())
    found |= v.name == "node.structural.1.load" && v.causality == Variable::input && v.size == 6;
  EXPECT_TRUE(found);
}

TEST(Client, ARefusedDeckTellsItsFindings) {
  Server server = connect();
  try {
    server.load_text("begin: data; problem: initial value; end: data; begin: nonsense;");
    FAIL() << "the deck was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.reason(), "DECK_ERROR");
    ASSERT_FALSE(error.diagnostics().empty());
    EXPECT_EQ(error.diagnostics().front().line, 1);
    EXPECT_FALSE(error.diagnostics().front().message.empty());
  }
  Simulation simulation = server.load_text(body());
  StepOptions wrong;
  wrong.step_size = -1;
  try {
    simulation.step(1, wrong);
    FAIL() << "the length was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "step_size");
  }
}

TEST(Client, ARecordTellsWhatCrossedThePorts) {
  Server server = connect();
  LoadOptions options = with_port();
  options.record = true;
  Simulation simulation = server.load_text(body(), options);
  const Peer peer = simulation.couple("spring", spring);
  ASSERT_TRUE(simulation.step(3).ok());
  EXPECT_GT(simulation.record().size(), 100u);
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

TEST_P(Coupled, APeerThatIsAheadIsRefusedUnlessItCanGoBack) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  {
    const Peer peer = simulation.couple("spring", spring, options());
    EXPECT_EQ(peer.step(), 0);
    EXPECT_TRUE(simulation.step(3).ok());
    EXPECT_EQ(peer.step(), 2) << "the last exchange that it answered";
  }
  PeerOptions ahead = options();
  ahead.step = 7;
  try {
    simulation.attach("spring", ahead);
    ADD_FAILURE() << "it was let in";
  } catch (const Error& error) {
    EXPECT_EQ(error.reason(), "PEER_AHEAD");
    EXPECT_EQ(error.metadata().at("step"), "3");
  }
  ahead.can_go_back = true;
  {
    const Peer back = simulation.couple("spring", spring, ahead);
    EXPECT_EQ(back.step(), 3);
    EXPECT_TRUE(simulation.step().ok());
  }
  PeerOptions behind = options();
  behind.step = 1;
  behind.mode = Mode::tight;
  const Peer late = simulation.couple("spring", spring, behind);
  EXPECT_EQ(late.step(), 1);
  EXPECT_TRUE(simulation.step(2).ok());
  const auto end = std::chrono::steady_clock::now() + mbcosim::stretched(10);
  while (late.step() != 6 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  EXPECT_EQ(late.step(), 6) << "the last step accepted";
}

TEST_P(Coupled, AnAnswerOfTheWrongLengthEndsThePeer) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  Peer peer = simulation.attach("spring", options());
  std::thread stepper([&] { EXPECT_EQ(simulation.step().outcome, Outcome::peer_lost); });
  Motion motion;
  ASSERT_TRUE(peer.next(motion));
  peer.answer(Loads{.forces = {1, 2}});
  EXPECT_FALSE(peer.error());
  EXPECT_FALSE(peer.next(motion));
  stepper.join();
  ASSERT_TRUE(peer.error());
  EXPECT_EQ(peer.error()->reason(), "BAD_ARGUMENT");
  EXPECT_FALSE(peer.next(motion)) << "what has ended stays so";
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
  options.server_timeout = 0.3 * time_factor();
  Peer peer = simulation.attach("spring", options);
  const auto step = [&] {
    std::this_thread::sleep_for(stretched(1));  // longer than the limit
    EXPECT_TRUE(simulation.step().ok());
  };
  std::thread stepper(step);
  Motion motion;
  EXPECT_TRUE(peer.next(motion)) << "the server gave no signs of life";
  peer.answer(spring(motion));
  stepper.join();
}

TEST_P(Coupled, APeerThatLeavesEndsInGoodOrder) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  Peer peer = simulation.couple("spring", spring, options());
  EXPECT_TRUE(simulation.step().ok());
  peer.close();
  EXPECT_FALSE(peer.error()) << peer.error()->what();
}

TEST(Client, WhatIsNoTimeoutIsRefusedByItsName) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  Stepper stepper = simulation.stepper();
  for (const double seconds : {-1.0, double(NAN), double(INFINITY), 1e10}) {
    const std::vector<std::function<void()>> calls = {
        [&] { Server::connect(std::getenv("MBCOSIM_ADDRESS"), seconds); },
        [&] { simulation.read("time", seconds); },
        [&] { server.load_text(body(), {.timeout = seconds}); },
        [&] { simulation.export_state(seconds); },
        [&] { simulation.subscribe({"time"}, {.timeout = seconds}); },
        [&] { simulation.attach("spring", {.timeout = seconds}); },
        [&] { server.events({}, {}, seconds); },
        [&] { stepper.step({}, 1, {}, seconds); }};
    for (const auto& call : calls) {
      try {
        call();
        ADD_FAILURE() << seconds << " s is taken";
      } catch (const Error& error) {
        EXPECT_EQ(error.field(), "timeout") << error.what();
      }
    }
  }
  EXPECT_EQ(simulation.refresh().step, 0);
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

TEST(Client, DecksThatCannotBeOpenedAreErrors) {
  const std::string folder = testing::TempDir();
  Server server = connect();
  for (const auto& [path, told] : {std::pair(folder + "none/x.mbd", "No such file or directory"),
                                   {folder + "none.mbd", "No such file or directory"},
                                   {folder + ".", "it is no regular file"}}) {
    try {
      server.load(path);
      ADD_FAILURE() << path;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("cannot open \""), std::string::npos)
          << error.what();
      EXPECT_NE(std::string(error.what()).find(told), std::string::npos) << error.what();
    }
  }
}

/// It would wait for itself.
TEST_P(Coupled, APeerIsNotClosedByItsOwnFunction) {
  Server server = connect();
  Simulation simulation = server.load_text(body("1.e-2"), with_port());
  std::atomic<Peer*> own = nullptr;
  Peer peer = simulation.couple(
      "spring",
      [&](const Motion& motion) {
        own.load()->close();
        return spring(motion);
      },
      options());
  own = &peer;
  const StepResult result = simulation.step();
  EXPECT_FALSE(result.ok());
  EXPECT_NE(result.failure.find("a peer cannot be closed by its own function"), std::string::npos)
      << result.failure;
  peer.close();
}

/// Stops the daemon while it lives.
/// From now on the server says nothing any more: test_cpp_client.py stops it, kills it or cuts the
/// connection when it finds this file, and takes the file away.
void silence() {
  const std::filesystem::path file(std::getenv("MBCOSIM_SILENCE"));
  std::ofstream(file).close();
  while (std::filesystem::exists(file)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

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

TEST(Client, TellsWhatCanBeDrawn) {
  Server server = connect();
  Simulation simulation = server.load_text(body());
  simulation.step(10);
  const Geometry geometry = simulation.geometry();
  EXPECT_EQ(geometry.step, 10);
  ASSERT_EQ(geometry.nodes.size(), 1u);
  const Geometry::Node& node = geometry.nodes[0];
  EXPECT_EQ(node.label, 1);
  EXPECT_EQ(node.kind, "dynamic");
  const std::vector<double> x = simulation.read("node.structural.1.X");
  EXPECT_EQ(std::vector<double>(node.position.begin(), node.position.end()), x);
  EXPECT_TRUE(node.orientation && node.orientation_handle);
  ASSERT_EQ(geometry.elements.size(), 1u);
  const Geometry::Element& element = geometry.elements[0];
  EXPECT_EQ(element.family, "body");
  ASSERT_EQ(element.masses.size(), 1u);
  EXPECT_EQ(element.masses[0].mass, 1);
  EXPECT_EQ(element.masses[0].principal_moments, (Geometry::Vector{1, 1, 1}));
  EXPECT_EQ(element.points[static_cast<std::size_t>(element.masses[0].point)].node, 1);
  try {
    simulation.geometry({.line_samples = 1});
    FAIL() << "one point makes no line";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "line_samples");
  }
}

/// Bodies in a row, with rods between them, the first of them clamped.
std::string chain(int n) {
  const std::string count = std::to_string(n);
  return "begin: data; problem: initial value; end: data; begin: initial value; initial time: 0.; "
         "final time: 1.; time step: 1.e-3; end: initial value; begin: control data; structural "
         "nodes: " +
         count + "; rigid bodies: " + count + "; joints: " + count +
         "; end: control data; begin: nodes; for: integer k = 1, " + count +
         "; structural: k, dynamic, real(k), 0., 0., eye, null, null; end for; end: nodes; "
         "begin: elements; for: integer k = 1, " +
         count +
         "; body: k, k, 1., null, eye; end for; "
         "for: integer k = 1, " +
         count +
         " - 1; joint: k, rod, k, k + 1, 1., linear elastic, 1.; "
         "end for; joint: " +
         count + ", clamp, 1, node, node; end: elements;";
}

TEST(Client, AModelOfTenThousandBodiesIsDescribedDrawnLinearizedAndStepped) {
  constexpr std::size_t kBodies = 10000;
  Server server = connect();
  Simulation simulation = server.load_text(chain(kBodies));
  const std::vector<Variable> variables = simulation.variables();
  EXPECT_GT(variables.size(), 3 * kBodies);
  for (std::size_t i = 0; i < variables.size(); ++i)
    ASSERT_EQ(variables[i].handle, static_cast<int>(i)) << "every page once, in order";
  const Geometry geometry = simulation.geometry();
  EXPECT_EQ(geometry.nodes.size(), kBodies);
  EXPECT_EQ(geometry.elements.size(), 2 * kBodies);
  const LinearModel linear = simulation.linearize_descriptor();
  EXPECT_TRUE(linear.A.sparse && linear.E.sparse);
  EXPECT_GE(linear.state_names.size(), 12 * kBodies);
  EXPECT_EQ(linear.A.values.size(), linear.A.column_indices.size());
  EXPECT_EQ(simulation.step().step, 1);
}

const Units kSi{"m", "kg", "", "s"}, kMillimetres{"mm", "t", "", "s"}, kByForce{"mm", "", "N", "s"};

TEST_P(Coupled, APeerCountsInUnitsOfItsOwn) {
  Server server = connect();
  LoadOptions load = with_port();
  load.units = kMillimetres;
  Simulation simulation = server.load_text(body(), load);
  for (const Variable& v : simulation.variables())
    if (v.name == "node.structural.1.load") {
      EXPECT_EQ(v.unit, "N, N mm");
      EXPECT_EQ(v.si_unit, "N, N m");
    }
  ASSERT_TRUE(simulation.refresh().units);
  EXPECT_EQ(simulation.refresh().units->mass, "t");
  PeerOptions options = this->options();
  options.mode = Mode::loose;
  options.units = kSi;
  std::vector<double> seen;
  {
    Peer peer = simulation.couple(
        "spring",
        [&](const Motion& motion) {
          seen.push_back(motion.v[1]);
          return Loads{.forces = {1, 2, 3}, .moments = {4, 5, 6}};
        },
        options);
    EXPECT_EQ(peer.layout().units->length, "m");
    EXPECT_EQ(simulation.step().outcome, Outcome::accepted);
  }
  EXPECT_DOUBLE_EQ(seen.at(0), 1e-3) << "1 mm/s";
  const std::vector<double> loads = simulation.read("node.structural.1.load");
  const std::vector<double> expected = {1, 2, 3, 4000, 5000, 6000};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(loads[i], expected[i]);
  simulation.reset();
  options.units = kByForce;  // the deck's own, told by its force
  Peer same = simulation.couple(
      "spring",
      [](const Motion&) {
        return Loads{.forces = {7, 8, 9}};
      },
      options);
  simulation.step();
  EXPECT_EQ(simulation.read("node.structural.1.load").at(2), 9);
}

TEST(Client, DurationsThatAreNoneAreRefusedByTheirField) {
  Server server = connect();
  const auto refused = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), 3);
      return error.field();
    }
    return "nothing";
  };
  for (const double none : {std::nan(""), HUGE_VAL, 1e300, -1.0}) {
    LoadOptions options;
    options.lease = none;
    EXPECT_EQ(refused([&] { server.load_text(body(), options); }), "lease");
    Simulation simulation = server.load_text(body(), with_port());
    EXPECT_EQ(refused([&] { simulation.subscribe({"time"}, {.minimum_interval = none}); }),
              "minimum_interval");
    EXPECT_EQ(refused([&] { simulation.attach("spring", {.peer_timeout = none}); }),
              "peer_timeout");
    EXPECT_EQ(refused([&] { simulation.attach("spring", {.heartbeat_timeout = none}); }),
              "heartbeat_timeout");
    for (const Transport transport : {Transport::stream, Transport::shared_memory})
      EXPECT_EQ(refused([&] {
                  simulation.attach("spring", {.server_timeout = none, .transport = transport});
                }),
                "server_timeout");
  }
}

TEST(Client, UnitsThatAreNoneAreRefusedByTheirField) {
  Server server = connect();
  LoadOptions options;
  options.units = Units{"furlong", "kg", "", "s"};
  try {
    server.load_text(body(), options);
    FAIL() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "units.length");
  }
  Simulation simulation = server.load_text(body(), with_port());
  EXPECT_EQ(code_of([&] { simulation.attach("spring", {.units = kSi}); }), 9)
      << "the deck's units are not declared";
}

TEST(Client, FetchesResultFiles) {
  Server server = connect();
  Simulation simulation =
      server.load_text(body(), {.results = ResultOptions{{ResultOptions::text}}});
  simulation.step(5);
  const auto files = simulation.result_files();
  ASSERT_EQ(files.count("results.mov"), 1u);
  const std::string all = simulation.result_file("results.mov");
  EXPECT_EQ(static_cast<std::int64_t>(all.size()), files.at("results.mov"));
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 6) << "the start and five steps";
  EXPECT_EQ(simulation.result_file("results.mov", 3, 10), all.substr(3, 10));
  EXPECT_EQ(code_of([&] { simulation.result_file("results.none"); }), 5);
}

TEST(Client, IsToldWhatHappens) {
  Server server = connect();
  Simulation simulation = server.load_text(body());
  Events events = server.events(simulation.name());
  const Snapshot saved = simulation.snapshot();
  simulation.restore(saved);
  Event event;
  ASSERT_TRUE(events.next(event));
  EXPECT_EQ(event.simulation, simulation.name());
  EXPECT_EQ(event.method, "Simulations/CreateSnapshot");
  ASSERT_TRUE(std::holds_alternative<Event::Snapshot>(event.content));
  EXPECT_EQ(std::get<Event::Snapshot>(event.content).change, Event::Snapshot::saved);
  EXPECT_EQ(std::get<Event::Snapshot>(event.content).name, saved.name);
  const EventPlace place = events.place();
  EXPECT_EQ(place.last, event.sequence);
  ASSERT_TRUE(events.next(event));
  EXPECT_EQ(std::get<Event::Snapshot>(event.content).change, Event::Snapshot::restored);
  events.close();
  EXPECT_FALSE(events.next(event));
  Events again = server.events(simulation.name(), place);
  ASSERT_TRUE(again.next(event));
  EXPECT_EQ(std::get<Event::Snapshot>(event.content).change, Event::Snapshot::restored);
}

TEST(AServerThatIsKilledAndComesBack, DoesEachCallOnce) {
  const char* kill = std::getenv("MBCOSIM_KILL");  // while this file is there, it may be away
  if (!kill) GTEST_SKIP() << "only with a daemon of its own";
  Server server = Server::connect(std::getenv("MBCOSIM_ADDRESS"), 10, {}, 60 * time_factor());
  Simulation simulation = server.load_text(body("1.e-6"), {.durability = Durability::journal});
  std::int64_t taken = 0;
  for (std::size_t kills = 1; kills <= 3; ++kills) {
    std::ofstream(kill).close();
    while (std::filesystem::exists(kill)) ASSERT_EQ(simulation.step().step, ++taken);
    simulation.snapshot();
    ASSERT_EQ(simulation.snapshots().size(), kills);
  }
  EXPECT_EQ(server.list().size(), 1u);
  EXPECT_EQ(server.find(simulation.name()).step().step, taken + 1);
}

TEST(AnUnreliableLine, LosesNoStepAndRepeatsNone) {
  const char* line = std::getenv("MBCOSIM_LINE");
  if (!line) GTEST_SKIP() << "only with a relay";
  Simulation near = connect().load_text(endless());
  Server server = Server::connect(line, 10, {}, 30 * time_factor());
  Simulation far = server.find(near.name());
  for (int step = 1; step <= 100; ++step) ASSERT_EQ(far.step().step, step);
}

TEST(AServerThatIsKilledAndComesBack, IsNotWaitedForWithoutWish) {
  const char* kill = std::getenv("MBCOSIM_KILL");
  if (!kill) GTEST_SKIP() << "only with a daemon of its own";
  Server server = connect();
  Simulation simulation = server.load_text(body("1.e-6"), {.durability = Durability::journal});
  std::ofstream(kill).close();
  const auto steps = [&] {
    while (std::filesystem::exists(kill)) simulation.step();
  };
  EXPECT_EQ(code_of(steps), 14);
}

TEST(ASilentServer, EndsEveryCallAtItsTimeout) {
  if (!std::getenv("MBCOSIM_SILENCE")) GTEST_SKIP() << "only with a daemon of its own";
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  const std::string x = "node.structural.1.X", load = "node.structural.1.load";
  const std::string deck = testing::TempDir() + "stopped.mbd";
  std::ofstream(deck) << body();
  const Snapshot saved = simulation.snapshot();
  const std::string bytes = simulation.export_state();
  Stepper stepper = simulation.stepper();
  stepper.step();
  const std::vector<std::pair<const char*, std::function<void()>>> calls = {
      {"version", [&] { server.version(0.3); }},
      {"load", [&] { server.load(deck, {.timeout = 0.3}); }},
      {"load_text", [&] { server.load_text(body(), {.timeout = 0.3}); }},
      {"load_bundle",
       [&] {
         server.load_bundle("a", {{"a", body()}}, {.timeout = 0.3});
       }},
      {"find", [&] { server.find(simulation.name(), 0.3); }},
      {"step", [&] { simulation.step(1, {.timeout = 0.3}); }},
      {"run_until", [&] { simulation.run_until(1, {.timeout = 0.3}); }},
      {"simulate", [&] { simulation.simulate(1, {x}, {.step = {.timeout = 0.3}}); }},
      {"read", [&] { simulation.read(x, 0.3); }},
      {"write", [&] { simulation.write(load, std::vector<double>(6), 0.3); }},
      {"interrupt", [&] { simulation.interrupt(0.3); }},
      {"list", [&] { server.list(0.3); }},
      {"load_from_root", [&] { server.load_from_root("a.mbd", {.timeout = 0.3}); }},
      {"validate", [&] { server.validate(deck, 0.3); }},
      {"stepper", [&] { simulation.stepper({"time"}, {}, 0.3).step({}, 1, {}, 0.3); }},
      {"step of a stream", [&] { stepper.step({}, 1, {}, 0.3); }},
      {"subscribe", [&] { simulation.subscribe({x}, {.timeout = 0.3}); }},
      {"refresh", [&] { simulation.refresh(0.3); }},
      {"update", [&] { simulation.update({.timeout = 0.3}); }},
      {"variables", [&] { simulation.variables(0.3); }},
      {"ports", [&] { simulation.ports(0.3); }},
      {"snapshot", [&] { simulation.snapshot("", 0.3); }},
      {"snapshots", [&] { simulation.snapshots(0.3); }},
      {"restore", [&] { simulation.restore(saved, 0.3); }},
      {"delete_snapshot", [&] { simulation.delete_snapshot(saved, 0.3); }},
      {"reset", [&] { simulation.reset(0.3); }},
      {"export_state", [&] { simulation.export_state(0.3); }},
      {"export_state of a snapshot", [&] { simulation.export_state(saved, 0.3); }},
      {"export_checkpoint", [&] { simulation.export_checkpoint(0.3); }},
      {"import_checkpoint", [&] { server.import_checkpoint(bytes, "", 0.3); }},
      {"import_state", [&] { simulation.import_state(bytes, true, "", 0.3); }},
      {"fork", [&] { simulation.fork({.timeout = 0.3}); }},
      {"fork of a snapshot", [&] { simulation.fork(saved, {.timeout = 0.3}); }},
      {"linearize", [&] { simulation.linearize({}, {}, 0.3); }},
      {"linearize_descriptor", [&] { simulation.linearize_descriptor({}, {}, 0.3); }},
      {"eigenvalues", [&] { simulation.eigenvalues(2, 0, false, 0.3); }},
      {"record", [&] { simulation.record(0.3); }},
      {"geometry", [&] { simulation.geometry({}, 0.3); }},
      {"result_files", [&] { simulation.result_files(0.3); }},
      {"result_file", [&] { simulation.result_file("results.mov", 0, {}, 0.3); }},
      {"events", [&] { server.events(simulation.name(), {}, 0.3); }},
      {"attach", [&] { simulation.attach("spring", {.timeout = 0.3}); }},
      {"couple", [&] { simulation.couple("spring", spring, {.timeout = 0.3}); }},
  };
  silence();
  for (const auto& [name, call] : calls) {
    int code = 0;
    EXPECT_LT(seconds_of([&, &c = call] { code = code_of(c); }), 0.3 + 2 * time_factor()) << name;
    EXPECT_TRUE(code == 4 || code == 14) << name << " ended with " << code;
  }
  EXPECT_LT(seconds_of([&] { Simulation(std::move(simulation)); }), 2 + 2 * time_factor());
}

/// The server has shared memory unless something stands between.
std::vector<Transport> transports_of(Server& server) {
  Simulation simulation = server.load_text(body(), with_port());
  try {
    simulation.attach("spring", {.transport = Transport::shared_memory});
  } catch (const Error&) {
    return {Transport::stream};
  }
  return {Transport::stream, Transport::shared_memory};
}

TEST(ASilentServer, IsNoticedInAStepWithoutATimeoutAndByPeersThatWait) {
  if (!std::getenv("MBCOSIM_SILENCE")) GTEST_SKIP() << "only with a daemon of its own";
  Server server = connect();
  Simulation simulation = server.load_text(endless());
  std::vector<Simulation> coupled;
  std::vector<Peer> peers;
  for (const Transport transport : transports_of(server)) {
    coupled.push_back(server.load_text(body(), with_port()));
    peers.push_back(coupled.back().attach("spring", {.transport = transport}));
  }
  std::thread later([] {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    silence();
  });
  const double bound = 1 + 20 + 7 * time_factor();  // keepalive: 10 s and 10 s
  std::vector<std::thread> waiting;
  for (Peer& peer : peers)
    waiting.emplace_back([&] {
      Motion motion;
      EXPECT_LT(seconds_of([&] { EXPECT_FALSE(peer.next(motion)); }), bound);
    });
  int code = 0;
  EXPECT_LT(seconds_of([&] { code = code_of([&] { simulation.run_until(1e9); }); }), bound);
  later.join();
  EXPECT_EQ(code, 14);
  for (std::thread& thread : waiting) thread.join();
  for (const Peer& peer : peers) EXPECT_EQ(peer.error() ? peer.error()->code() : 0, 14);
}

TEST(ASilentServer, KeepsNoDestructorOfAPeer) {
  if (!std::getenv("MBCOSIM_SILENCE")) GTEST_SKIP() << "only with a daemon of its own";
  Server server = connect();
  std::vector<Simulation> coupled;
  std::vector<Peer> peers;
  for (const Transport transport : transports_of(server)) {
    coupled.push_back(server.load_text(body(), with_port()));
    peers.push_back(coupled.back().couple("spring", spring, {.transport = transport}));
  }
  silence();
  for (Peer& peer : peers)
    EXPECT_LT(seconds_of([&] { Peer(std::move(peer)); }), 2 + 2 * time_factor());
}

}  // namespace
}  // namespace mbcosim::client::client_test
