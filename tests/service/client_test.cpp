/// The C++ client library against the daemon at $MBCOSIM_ADDRESS; started by test_cpp_client.py.
#include "client/mbcosim_client.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace mbcosim::client {
namespace {

constexpr double kStiffness = 400;

Server connect() { return Server::connect(std::getenv("MBCOSIM_ADDRESS")); }

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

TEST(Client, CoupledPeerMakesAnOscillator) {
  Server server = connect();
  Simulation simulation = server.load_text(body("1.e-2"), with_port());
  PeerOptions options;
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

TEST(Client, SynchronousPeerGivesTheSameBits) {
  Server server = connect();
  std::vector<double> found[2];
  for (const bool synchronous : {false, true}) {
    Simulation simulation = server.load_text(body(), with_port());
    if (!synchronous) {
      const Peer peer = simulation.couple("spring", spring);
      ASSERT_TRUE(simulation.step(50).ok());
    } else {
      Peer peer = simulation.attach("spring");
      std::thread stepper([&] { EXPECT_TRUE(simulation.step(50).ok()); });
      Motion motion;
      for (int k = 0; k < 50 && peer.next(motion); ++k) peer.answer(spring(motion));
      stepper.join();
    }
    found[synchronous] = simulation.read("node.structural.1.X");
  }
  EXPECT_EQ(found[0], found[1]);
}

TEST(Client, APeerThatThrowsFailsTheStepWithItsText) {
  Server server = connect();
  Simulation simulation = server.load_text(body(), with_port());
  const Peer peer = simulation.couple(
      "spring", [](const Motion&) -> Loads { throw std::runtime_error("no wind today"); });
  const StepResult result = simulation.step();
  EXPECT_EQ(result.outcome, Outcome::peer_lost);
  EXPECT_NE(result.failure.find("no wind today"), std::string::npos);
  EXPECT_EQ(result.step, 0);
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

}  // namespace
}  // namespace mbcosim::client
