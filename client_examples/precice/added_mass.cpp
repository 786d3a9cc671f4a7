// A small fluid for trying preCICE participants: each point of its mesh pushes back with
//
//   f = −(M a + C v + K d)
//
// where d and v are the displacement and velocity that it reads, and the acceleration a follows
// from v by the trapezoidal rule, v₁ = v₀ + h/2 (a₀ + a₁), with a = 0 at the start. A body that it
// surrounds moves as if it were heavier by M, with a damper C and a spring K to the ground; an M
// above the body's mass needs an implicit scheme that accelerates.
//
// usage: added_mass CONFIGURATION STEP M C K X Y Z [X Y Z ...]
//
// STEP: longest time step [s]. [kg], [N s/m], [N/m] for each point, and the points [m], two numbers
// each in a mesh of two dimensions. Participant "Fluid" with mesh "Fluid-Mesh" reads "Displacement"
// and "Velocity" and writes "Force".
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <precice/precice.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

constexpr char kMesh[] = "Fluid-Mesh";

struct Law {
  double step;  ///< the longest [s]
  double mass, damping, stiffness;
};

struct State {
  std::vector<double> v, a;  ///< (dimensions × points) [m/s], [m/s²]
};

class Fluid {
 public:
  Fluid(const char* configuration, const Law& law, const std::vector<double>& points)
      : participant_("Fluid", configuration, 0, 1),
        law_(law),
        ids_(points.size() / static_cast<std::size_t>(participant_.getMeshDimensions(kMesh))) {
    participant_.setMeshVertices(kMesh, points, ids_);
    const std::vector<double> rest(points.size(), 0.0);
    now_ = {rest, rest};
  }

  void run() {
    if (participant_.requiresInitialData()) participant_.writeData(kMesh, "Force", ids_, now_.a);
    participant_.initialize();
    State checkpoint;
    while (participant_.isCouplingOngoing()) {
      if (participant_.requiresWritingCheckpoint()) checkpoint = now_;
      participant_.advance(step());
      if (participant_.requiresReadingCheckpoint()) now_ = checkpoint;
    }
  }

 private:
  std::vector<double> read(const char* data, double after) {
    std::vector<double> values(now_.v.size());
    participant_.readData(kMesh, data, ids_, after, values);
    return values;
  }

  double step() {
    const double window = participant_.getMaxTimeStepSize();
    const double h = window / std::max(1.0, std::ceil(window / law_.step - 1e-9));
    const std::vector<double> d = read("Displacement", h), v = read("Velocity", h);
    std::vector<double> force(d.size());
    for (std::size_t i = 0; i < d.size(); ++i) {
      now_.a[i] = 2 / h * (v[i] - now_.v[i]) - now_.a[i];
      now_.v[i] = v[i];
      force[i] = -(law_.mass * now_.a[i] + law_.damping * v[i] + law_.stiffness * d[i]);
    }
    participant_.writeData(kMesh, "Force", ids_, force);
    return h;
  }

  precice::Participant participant_;
  const Law law_;
  std::vector<precice::VertexID> ids_;
  State now_;
};

double number(const char* text) {
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (end == text || *end != '\0' || !std::isfinite(value))
    throw std::invalid_argument(std::string("a number expected, got \"") + text + '"');
  return value;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr int kBefore = 6;  // arguments before the points
  if (argc <= kBefore) {
    std::fprintf(stderr, "usage: added_mass CONFIGURATION STEP M C K X Y Z [X Y Z ...]\n");
    return 4;
  }
  std::unique_ptr<Fluid> fluid;  // outlives a failure: see participant.cpp
  try {
    std::vector<double> points;
    for (int i = kBefore; i < argc; ++i) points.push_back(number(argv[i]));
    const Law law{number(argv[2]), number(argv[3]), number(argv[4]), number(argv[5])};
    fluid = std::make_unique<Fluid>(argv[1], law, points);
    fluid->run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    std::fflush(nullptr);
    std::_Exit(3);
  }
}
