#include "word_cards.h"

namespace mbcosim::decks {
namespace {

/// Drives: node 1 moves, joint 80 is a rod, drive 81 the time, file driver 82 two columns.
constexpr const char* kDrives[] = {
    "array, 2, time, sine, 0., 3., 2., forever, 1.",
    "bistop, initial status, active, sine, 0., 900., 1., forever, 0., cosine, 0., 700., 1., "
    "forever, 0.",
    "closest next, 0., forever, const, 1.5e-3",
    "const, 2.5",
    "cosine, 1e-3, 30., 2., 3, .5",
    "cubic, .1, .2, .3, .4",
    "direct",
    "discrete filter, 2, .5, -.25, .25, 1, .1, time",
    "dof, 1, structural, 2, differential, linear, .1, 2.",
    "double ramp, 20., 1e-3, 3e-3, -10., 4e-3, forever, .5",
    "double step, 1e-3, 4e-3, 2., .5",
    "drive, linear, .1, 2., time",
    "element, 80, joint, string, \"F\", linear, .1, 2.",
    "exponential, 2., .1, 1e-3, .5",
    "file, 82, 2, amplitude, 3.",
    "fourier series, 1e-3, 30., 2, .5, 1., 2., 3., 4., forever, .5",
    "frequency sweep, 0., linear, 30., 9., const, 2., .1, forever, .2",
    "linear, .1, 2.",
    "max, 2, time, const, 2e-3",
    "meter, 0., forever, steps, 3",
    "min, 2, time, const, 2e-3",
    "mult, time, linear, .1, 2.",
    "node, 1, structural, string, \"X[2]\", linear, .1, 2.",
    "null",
    "one",
    "parabolic, .1, .2, .3",
    "periodic, 0., 3e-3, linear, .1, 2.",
    "piecewise linear, 3, 0., 1., 2e-3, 3., 1., 2.",
    "postponed, 81",
    "ramp, 20., 1e-3, 4e-3, .5",
    "random, 2., .5, 0., forever, steps, 2, seed, 7",
    "sample and hold, time, sine, 0., 900., 1., forever, 0., initial value, .5",
    "scalar function, \"f\"",
    "sine, 1e-3, 30., 2., forever, .5",
    "step, 2e-3, 2., .5",
    "step5, 1e-3, .5, 4e-3, 2.",
    "string, \"sin(30.*Time) + Var\"",
    "tanh, 2e-3, 2., 100., .5",
    "time",
    "timestep",
    "unit",
};

constexpr const char* kFunctions[] = {
    "chebychev, -1., 1., do not extrapolate, 1., .5, .25, end",
    "const, 2.5",
    "cubic spline, do not extrapolate, -1., 2., 0., 1., 1., 3., end",
    "div, \"g\", \"h\"",
    "exp, base, 2., coefficient, .5, 3.",
    "linear, 0., 1., 1., 3.",
    "log, base, 2., coefficient, .5, 3.",
    "mul, \"g\", \"h\"",
    "multilinear, do not extrapolate, -1., 2., 0., 1., 1., 3., end",
    "pow, 2.5",
    "sub, \"g\", \"h\"",
    "sum, \"g\", \"h\"",
};

constexpr const char* kFluids[] = {
    "exponential, density, 870., sound celerity, 1300., 1e5, viscosity, .07, temperature, 293., 0.",
    "incompressible, density, 870., viscosity, .07, pressure, 1e5, temperature, 293.",
    "linear compressible, density, 870., sound celerity, 1300., 1e5, viscosity, .07, temperature, "
    "293.",
    "linear thermal compressible, density, 870., 1.5e9, 1e5, 1e-4, 293., viscosity, .07",
    "super, density, 870., sound celerity, 1300., 1e5, viscosity, .07, temperature, 293.",
    "uncompressible, density, 870., viscosity, .07, pressure, 1e5, temperature, 293.",
};

constexpr const char* kFileDrivers[] = {
    "RTAI input, stream drive name, \"in\", grpc, 2",
    "fixed step, 3, 2, initial time, 0., time step, .1, interpolation, linear, pad zeroes, no, "
    "\"fixed\"",
    "socket stream, stream drive name, \"in\", grpc, 2",
    "socket, 2, initial values, .5, 1.5, port, 5555",
    "stream, stream drive name, \"in\", grpc, 2, initial values, .5, 1.5",
    "variable step, 2, interpolation, linear, pad zeroes, no, \"variable\"",
};

std::string first_word(const std::string& text) { return text.substr(0, text.find(',')); }

}  // namespace

std::vector<WordCard> drive_cards() {
  std::vector<WordCard> all;
  for (const std::string drive : kDrives) {
    WordCard& c = all.emplace_back();
    c.word = "drive: " + first_word(drive);
    c.before =
        "scalar function: \"f\", pow, 2.; joint: 80, rod, 1, 2, 1.2, linear elastic, 10.; drive "
        "caller: 81, time;";
    c.card = "drive caller: 90, " + drive;
    c.after = "force: 90, abstract, 11, abstract, reference, 90;";
  }
  return all;
}

std::vector<WordCard> function_cards() {
  std::vector<WordCard> all;
  for (const std::string function : kFunctions) {
    WordCard& c = all.emplace_back();
    c.word = "function: " + first_word(function);
    c.before = "scalar function: \"g\", pow, 3.; scalar function: \"h\", const, 2.;";
    c.card = "scalar function: \"f\", " + function;
    c.after =
        "drive caller: 91, scalar function, \"f\"; force: 90, abstract, 11, abstract, drive, "
        "reference, 91, linear, .1, 20.;";
  }
  return all;
}

std::vector<WordCard> fluid_cards() {
  std::vector<WordCard> all;
  for (const std::string fluid : kFluids) {
    WordCard& c = all.emplace_back();
    c.word = "fluid: " + first_word(fluid);
    c.card = "hydraulic fluid: 90, " + fluid;
    c.after =
        "hydraulic: 90, dynamic pipe, 31, 32, .01, 2., fluid, reference, 90; hydraulic: 91, "
        "orifice, 31, 32, .01, 1.e-5, fluid, reference, 90;";
  }
  return all;
}

std::vector<WordCard> file_driver_cards() {
  std::vector<WordCard> all;
  for (const std::string driver : kFileDrivers) {
    WordCard& c = all.emplace_back();
    c.word = "file driver: " + first_word(driver);
    c.card = "file: 90, " + driver;
    c.after = "force: 90, abstract, 11, abstract, file, 90, 2, amplitude, 3.;";
    c.driver = true;
  }
  return all;
}

}  // namespace mbcosim::decks
