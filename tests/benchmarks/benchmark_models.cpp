#include "benchmark_models.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "input/sources.h"
#include "simulation/load.h"

namespace mbcosim::benchmarks {

namespace {

std::string number(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", v);
  return text;
}

std::string blocks(const std::string& counts, const std::string& nodes, const std::string& elements,
                   const std::string& initial = "") {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: forever; "
         "time step: 1e-3; method: ms, .6; max iterations: 30; tolerance: 1e-6; derivatives "
         "tolerance: 1e3; " +
         initial + "end: initial value;\nbegin: control data; default output: none; " + counts +
         "end: control data;\nbegin: nodes;\n" + nodes + "end: nodes;\nbegin: elements;\n" +
         elements + "end: elements;\n";
}

}  // namespace

Bundle rigid_chain(int links) {
  std::string nodes, elements = "gravity: uniform, 0.,0.,-1., const, 9.81;\n";
  for (int k = 1; k <= links; ++k) {
    const std::string label = std::to_string(k);
    nodes += "structural: " + label + ", dynamic, " + number(k - .5) + ",0.,0., eye, null, null;\n";
    elements += "body: " + label + ", " + label + ", 1., null, diag, .01,.08,.08;\n";
    elements += k == 1 ? "joint: 1, spherical pin, 1, -.5,0.,0., 0.,0.,0.;\n"
                       : "joint: " + label + ", spherical hinge, " + std::to_string(k - 1) +
                             ", .5,0.,0., " + label + ", -.5,0.,0.;\n";
  }
  const std::string n = std::to_string(links);
  return {{"deck.mbd", blocks("structural nodes: " + n + "; rigid bodies: " + n + "; joints: " + n +
                                  "; gravity; ",
                              nodes, elements)}};
}

Bundle cantilever(int count) {
  const int nodes_count = 2 * count + 1;
  const double piece = 0.5;
  std::string nodes, elements = "joint: 1, clamp, 0, node, node;\nforce: 1, follower, " +
                                std::to_string(nodes_count - 1) +
                                ", position, null, 0.,1.,0., ramp, .1, 0., forever, 0.;\n";
  for (int k = 0; k < nodes_count; ++k) {
    const std::string label = std::to_string(k);
    nodes += "structural: " + label + (k == 0 ? ", static, " : ", dynamic, ") + number(k * piece) +
             ",0.,0., eye, null, null;\n";
    if (k == 0) continue;
    const double j = std::pow(piece, 3) / 12;
    elements += "body: " + label + ", " + label + ", " + number(piece) + ", null, diag, " +
                number(1e-4 * piece) + "," + number(j) + "," + number(j) + ";\n";
  }
  for (int k = 0; k < count; ++k) {
    elements += "beam3: " + std::to_string(k + 1);
    for (int n = 0; n < 3; ++n) elements += ", " + std::to_string(2 * k + n) + ", null";
    elements +=
        ", eye, linear elastic generic, diag, 1e6, 1e6, 1e6, 100., 100., 200., same, same;\n";
  }
  return {{"deck.mbd", blocks("structural nodes: " + std::to_string(nodes_count) +
                                  "; rigid bodies: " + std::to_string(nodes_count - 1) +
                                  "; beams: " + std::to_string(count) + "; joints: 1; forces: 1; ",
                              nodes, elements, "tolerance: 1e-4; ")}};
}

Bundle modal_body(int modes) {
  const int points = 20;
  std::string fem =
      "** MBDyn MODAL DATA FILE\n** NODE SET \"ALL\"\n\n** RECORD GROUP 1, HEADER\n**   REVISION, "
      "NODE, NORMAL, ATTACHMENT, "
      "CONSTRAINT, REJECTED MODES.\n REV0 " +
      std::to_string(points) + " " + std::to_string(modes) +
      " 0 0 0\n**\n** RECORD GROUP 2, FINITE ELEMENT NODE LIST\n";
  for (int k = 1; k <= points; ++k) fem += std::to_string(k) + "\n";
  const char* const titles[] = {"** RECORD GROUP 3, INITIAL MODAL DISPLACEMENTS\n",
                                "** RECORD GROUP 4, INITIAL MODAL VELOCITIES\n"};
  for (const char* title : titles) {
    fem += title;
    for (int j = 0; j < modes; ++j) fem += "0.\n";
  }
  for (int axis = 0; axis < 3; ++axis) {
    fem += "** RECORD GROUP " + std::to_string(5 + axis) + ", NODAL COORDINATES\n";
    for (int k = 0; k < points; ++k)
      fem += (axis == 0 ? number(k / (points - 1.0)) : "0.") + std::string("\n");
  }
  fem += "** RECORD GROUP 8, MODE SHAPES\n";
  for (int j = 0; j < modes; ++j) {
    fem += "**    NORMAL MODE SHAPE #  " + std::to_string(j + 1) + "\n";
    for (int k = 0; k < points; ++k) {
      const double x = k / (points - 1.0), a = (j / 2 + 1) * M_PI / 2,
                   shape = .1 * x * x * std::sin(a * x + .3), slope = .1 * x * std::cos(a * x);
      fem += j % 2 ? "0. 0. " + number(shape) + " 0. " + number(-slope) + " 0.\n"
                   : "0. " + number(shape) + " 0. 0. 0. " + number(slope) + "\n";
    }
  }
  const auto diagonal = [&](int group, const char* title, auto&& value) {
    fem += "** RECORD GROUP " + std::to_string(group) + ", " + title + "\n";
    for (int i = 0; i < modes; ++i) {
      for (int j = 0; j < modes; ++j) fem += i == j ? number(value(i)) + " " : "0. ";
      fem += "\n";
    }
  };
  diagonal(9, "MODAL MASS MATRIX", [](int) { return 1.0; });
  diagonal(10, "MODAL STIFFNESS MATRIX", [](int i) { return std::pow(20.0 * (i / 2 + 1), 2); });
  fem += "** RECORD GROUP 11, DIAGONAL OF LUMPED MASS MATRIX\n";
  for (int k = 0; k < points; ++k) fem += ".05 .05 .05 1e-5 1e-5 1e-5\n";
  const std::string nodes =
                        "structural: 1, modal, null, eye, null, 0.,0.,1.;\nstructural: 2, static, "
                        "null, eye, null, 0.,0.,1.;\n"
                        "structural: 3, dynamic, 1.,0.,0., eye, 0.,1.,0., 0.,0.,1.;\n",
                    elements = "joint: 1, modal, 1, " + std::to_string(modes) + ", " +
                               std::to_string(points) +
                               ", no damping, \"body.fem\", 2, \"1\", 2, null, \"" +
                               std::to_string(points) +
                               "\", 3, null;\nbody: 3, 3, .1, null, diag, 1e-4,1e-4,1e-4;\n"
                               "joint: 2, total pin joint, 2, position, null, position, null, "
                               "position constraint, active, active, active, null, "
                               "orientation constraint, active, active, inactive, null;\n";
  return {
      {"deck.mbd", blocks("structural nodes: 3; rigid bodies: 1; joints: 2; ", nodes, elements)},
      {"body.fem", fem}};
}

std::unique_ptr<Simulation> after_three_steps(const std::string& model) {
  int elements = 0;
  const auto [end, error] = std::from_chars(model.data(), model.data() + model.size(), elements);
  const bool is_number = error == std::errc() && end == model.data() + model.size();
  if (is_number && elements < 1) return nullptr;
  const std::filesystem::path path(model);
  const LoadReport report = is_number ? load_deck(BundleSource(cantilever(elements)), "deck.mbd")
                                      : load_deck(FolderSource(path.parent_path().string(), true),
                                                  path.filename().string());
  if (!report.ok()) return nullptr;
  auto simulation = Simulation::create(report.model);
  if (!simulation || (*simulation)->step_many(3).error) return nullptr;
  return std::move(*simulation);
}

}  // namespace mbcosim::benchmarks
