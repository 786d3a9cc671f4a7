/// Each joint between two bodies under random loads: blocked motions stay at zero, free ones
/// happen.
#include <random>
#include <regex>

#include "deck_run.h"

namespace mbcosim::joint_motions_test {
namespace {

/// Relative motions in the frame of the joint: displacement, rotation vector; and what universal
/// joints block: the product of axis 3 of the first frame with axis 2 of the second.
enum Motion : unsigned { dx = 1, dy = 2, dz = 4, rx = 8, ry = 16, rz = 32, cardan = 64 };
constexpr unsigned kPosition = dx | dy | dz, kRotation = rx | ry | rz, kAll = kPosition | kRotation;

struct JointCase {
  const char* name;
  const char* card;  ///< $N1, $N2: node; $P, $D: position and displaced position; $H: hinge in the
                     ///< common frame
  unsigned blocked;
  bool ground = false;  ///< the first body stands still
};

std::string replaced(std::string text,
                     const std::vector<std::pair<std::string, std::string>>& words) {
  for (const auto& [from, to] : words)
    for (std::size_t at; (at = text.find(from)) != std::string::npos;)
      text.replace(at, from.size(), to);
  return text;
}

class JointMotions : public testing::TestWithParam<JointCase> {
 protected:
  std::string vector(double scale = 1) {
    std::uniform_real_distribution<double> d(-scale, scale);
    std::string s;
    for (int i = 0; i < 3; ++i) s += (i ? "," : "") + std::to_string(d(random_));
    return s;
  }
  std::string deck() {
    const JointCase& c = GetParam();
    const std::string frame = "reference, 9, eye", point = "reference, 9, null";
    const std::string card =
        replaced(c.card, {{"$N1", c.ground ? "2" : "1"},
                          {"$N2", "2"},
                          {"$TP", "position, " + point + ", position orientation, " + frame +
                                      ", rotation orientation, " + frame},
                          {"$P", point},
                          {"$H", "hinge, " + frame},
                          {"$F", frame}});
    std::string nodes, elements, forces;
    for (const char* label : {"1", "2"}) {
      const std::string n = label;
      nodes += "structural: " + n + ", dynamic, " + vector() + ", vector, " + vector() +
               ", null, null;\n";
      elements += "body: " + n + ", " + n + ", 1.3, " + vector(.1) + ", diag, .3, .4, .5;\n";
      elements += "force: " + n + ", absolute, " + n + ", position, " + vector(.3) + ", " +
                  vector() + ", const, 40.;\n";
      elements += "couple: 1" + n + ", absolute, " + n + ", " + vector() + ", const, 20.;\n";
    }
    if (c.ground) elements += "joint: 1, clamp, 1, node, node;\n";
    return initial_value_block(2e-3, 10,
                               "max iterations: 30; tolerance: 1e-10; derivatives tolerance: 1.; "
                               "derivatives coefficient: "
                               "1e-3; method: ms, .6;") +
           "begin: control data; structural nodes: 2; rigid bodies: 2; forces: 4; joints: " +
           (c.ground ? "2" : "1") + "; end: control data;\nreference: 9, " + vector() +
           ", vector, " + vector() + ", null, null;\nbegin: nodes;\n" + nodes +
           "end: nodes;\nbegin: elements;\n" + elements + "joint: 7, " + card +
           ";\nend: elements;\n";
  }
  std::mt19937 random_{20240611};
};

/// Attachments of both bodies to the frame in which the joint was given.
struct Attached {
  Vec3 x1, x2;
  Mat3 H1, H2;
};
Attached follow(const DeckRun& run, const NodeState start[2], const Vec3& point,
                const Mat3& frame) {
  Attached a;
  const auto carried = [&](int k, Vec3& x, Mat3& H) {
    const NodeState now = run.node(k + 1);
    const Mat3 turn = now.R * start[k].R.transpose();
    x = now.x + turn * (point - start[k].x);
    H = turn * frame;
  };
  carried(0, a.x1, a.H1);
  carried(1, a.x2, a.H2);
  return a;
}

TEST_P(JointMotions, BlockedOnesStayFreeOnesHappen) {
  const std::string text = deck();
  std::smatch numbers;
  const std::string number = "([-0-9.]+)", three = number + "," + number + "," + number;
  ASSERT_TRUE(std::regex_search(text, numbers,
                                std::regex("reference: 9, " + three + ", vector, " + three)));
  const auto at = [&](int i) {
    return Vec3(std::stod(numbers[i]), std::stod(numbers[i + 1]), std::stod(numbers[i + 2]));
  };
  const Vec3 point = at(1);
  const Mat3 frame = rotation_of_vector<double>(at(4));
  DeckRun run(text);
  ASSERT_TRUE(run.ready());
  const NodeState start[2] = {run.node(1), run.node(2)};
  run.step(150);
  const Attached a = follow(run, start, point, frame);
  const Vec3 d = a.H1.transpose() * (a.x2 - a.x1),
             theta = vector_of_rotation<double>(a.H1.transpose() * a.H2);
  const double values[] = {
      d(0), d(1), d(2), theta(0), theta(1), theta(2), a.H1.col(2).dot(a.H2.col(1))};
  const char* const names[] = {"dx", "dy", "dz", "rx", "ry", "rz", "cardan"};
  const unsigned blocked = GetParam().blocked;
  for (int k = 0; k < 7; ++k) {
    if (blocked & (1u << k)) {
      EXPECT_NEAR(values[k], 0, 2e-9) << names[k];
    } else if (k < 6) {
      EXPECT_GT(std::abs(values[k]), 1e-3) << names[k];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Joints, JointMotions,
    testing::Values(
        JointCase{"SphericalHinge", "spherical hinge, 1, $P, $H, 2, $P, $H", kPosition},
        JointCase{"RevoluteHinge", "revolute hinge, 1, $P, $H, 2, $P, $H", kPosition | rx | ry},
        JointCase{"PlaneHinge", "plane hinge, 1, $P, $H, 2, $P, $H", kPosition | rx | ry},
        JointCase{"RevoluteRotation", "revolute rotation, 1, $H, 2, $H", rx | ry},
        JointCase{"AxialRotation", "axial rotation, 1, $P, $H, 2, $P, $H, const, 0.", kAll},
        JointCase{"Prismatic", "prismatic, 1, $H, 2, $H", kRotation},
        JointCase{"InLine", "in line, 1, $P, $F, 2, offset, $P", dx | dy},
        JointCase{"InPlane", "in plane, 1, $P, reference, 9, 0.,0.,1., 2, offset, $P", dz},
        JointCase{"CardanoHinge", "cardano hinge, 1, $P, $H, 2, $P, $H", kPosition | cardan},
        JointCase{"UniversalRotation", "universal rotation, 1, $H, 2, $H", cardan},
        JointCase{"Gimbal", "gimbal rotation, 1, $H, 2, $H", rz},
        JointCase{"DriveHinge", "drive hinge, 1, $H, 2, $H, null", kRotation},
        JointCase{"DriveDisplacement", "drive displacement, 1, $P, 2, $P, null", kPosition},
        JointCase{"TotalAll",
                  "total joint, 1, $TP, 2, $TP, position constraint, active, active, active, null, "
                  "orientation constraint, "
                  "active, active, active, null",
                  kAll},
        JointCase{
            "TotalPosition",
            "total joint, 1, $TP, 2, $TP, position constraint, active, inactive, active, null",
            dx | dz},
        JointCase{
            "TotalRotation",
            "total joint, 1, $TP, 2, $TP, orientation constraint, active, active, inactive, null",
            rx | ry},
        JointCase{"TotalVelocity",
                  "total joint, 1, $TP, 2, $TP, position constraint, active, active, active, null, "
                  "orientation constraint, "
                  "angular velocity, angular velocity, angular velocity, null",
                  kAll},
        JointCase{"Clamp", "clamp, 2, node, node", kAll, true},
        JointCase{"SphericalPin", "spherical pin, 2, $P, $P", kPosition, true},
        JointCase{"RevolutePin", "revolute pin, 2, $P, $H, $P, $H", kPosition | rx | ry, true},
        JointCase{"CardanoPin", "cardano pin, 2, $P, $H, $P, $H", kPosition | cardan, true},
        JointCase{"DriveDisplacementPin", "drive displacement pin, 2, $P, $P, null", kPosition,
                  true},
        JointCase{"TotalPin",
                  "total pin joint, 2, $TP, $TP, position constraint, inactive, active, active, "
                  "null, orientation "
                  "constraint, active, active, active, null",
                  dy | dz | kRotation, true}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbcosim::joint_motions_test
