/// Words of MBDyn's input language that this program knows and does not serve. A deck that uses one
/// is refused by name. A word that is registered by its family is served, whatever stands here.
#include <initializer_list>

#include "elements/families.h"

namespace mbcosim {

namespace {

void refuse(Registry& r, const char* context, const char* what,
            std::initializer_list<const char*> words) {
  for (const char* word : words) r.unsupported(context, word, what);
}

void refuse_elements(Registry& r) {
  refuse(r, "elements", "plate", {"membrane4eas", "shell4eas", "shell4easans"});
  refuse(r, "elements", "aerodynamic element",
         {"aerodynamic body", "aerodynamic beam", "aerodynamic beam2", "aerodynamic beam3",
          "aircraft instruments", "generic aerodynamic force", "aerodynamic external",
          "aerodynamic external modal"});
  refuse(r, "elements", "induced velocity element", {"induced velocity", "rotor"});
  refuse(r, "elements", "aerodynamics", {"aero modal", "air properties", "gust"});
  refuse(r, "elements", "joint regularization", {"joint regularization"});
  refuse(r, "elements", "output element",
         {"output element", "stream output", "stream motion output"});
  refuse(r, "elements", "element",
         {"inertia", "automatic structural", "genel", "hydraulic", "electric", "beam", "beam2",
          "beam3", "force", "couple", "joint", "body", "gravity"});
}

void refuse_types(Registry& r) {
  refuse(r, "joint", "joint",
         {"angular acceleration",
          "angular velocity",
          "axial rotation",
          "beam slider",
          "brake",
          "cardano hinge",
          "cardano pin",
          "cardano rotation",
          "clamp",
          "deformable axial joint",
          "deformable displacement hinge",
          "deformable displacement joint",
          "deformable hinge",
          "deformable joint",
          "distance",
          "distance with offset",
          "drive displacement",
          "drive displacement pin",
          "drive hinge",
          "gimbal rotation",
          "imposed displacement",
          "imposed displacement pin",
          "imposed orientation",
          "in line",
          "in plane",
          "invariant deformable displacement joint",
          "invariant deformable hinge",
          "linear acceleration",
          "linear velocity",
          "modal",
          "plane hinge",
          "plane pin",
          "point contact",
          "prismatic",
          "revolute hinge",
          "revolute pin",
          "revolute rotation",
          "rod",
          "rod bezier",
          "rod with offset",
          "screw",
          "spherical hinge",
          "spherical pin",
          "total equation",
          "total internal reaction",
          "total joint",
          "total pin joint",
          "universal hinge",
          "universal pin",
          "universal rotation",
          "viscous body"});
  refuse(r, "couple", "couple",
         {"absolute", "absolute internal", "conservative", "follower", "follower internal",
          "total internal"});
  refuse(
      r, "force", "force",
      {"absolute", "absolute displacement", "absolute internal", "absolute internal displacement",
       "abstract", "abstract internal", "conservative", "external modal", "external modal mapping",
       "external structural", "external structural mapping", "follower", "follower internal",
       "modal", "total", "total internal"});
  refuse(r, "genel", "genel",
         {"clamp", "cross spring support", "distance", "mass", "rotor trim", "scalar filter",
          "spring", "spring support", "state space MIMO", "state space SISO", "swash plate"});
  refuse(r, "electric", "electric element",
         {"accelerometer", "discrete control", "displacement", "motor"});
  refuse(r, "hydraulic", "hydraulic element",
         {"accumulator", "actuator", "control valve", "control valve2", "dynamic control valve",
          "dynamic pipe", "flow valve", "minor loss", "orifice", "pipe",
          "pressure flow control valve", "pressure valve", "tank", "three way minor loss"});
}

void refuse_objects(Registry& r) {
  refuse(r, "drive", "drive",
         {"array",
          "bistop",
          "closest next",
          "cosine",
          "cubic",
          "direct",
          "discrete filter",
          "dof",
          "double ramp",
          "double step",
          "element",
          "exponential",
          "file",
          "fourier series",
          "frequency sweep",
          "linear",
          "meter",
          "mult",
          "node",
          "parabolic",
          "periodic",
          "piecewise linear",
          "postponed",
          "ramp",
          "random",
          "sample and hold",
          "scalar function",
          "sine",
          "step",
          "step5",
          "string",
          "tanh",
          "timestep",
          "unit"});
  refuse(r, "law", "constitutive law",
         {"array",
          "axial wrapper",
          "bistop",
          "cubic elastic generic",
          "double linear elastic",
          "double linear viscoelastic",
          "inverse square elastic",
          "invariant angular",
          "isotropic hardening elastic",
          "linear elastic",
          "linear elastic bistop",
          "linear elastic generic",
          "linear elastic generic axial torsion coupling",
          "linear elastic isotropic",
          "linear viscoelastic",
          "linear viscoelastic bistop",
          "linear viscoelastic generic",
          "linear viscoelastic generic axial torsion coupling",
          "linear viscoelastic isotropic",
          "linear viscous",
          "linear viscous generic",
          "linear viscous isotropic",
          "linear time variant viscoelastic generic",
          "log elastic",
          "nlp elastic",
          "nlp viscoelastic",
          "nlp viscous",
          "nlsf elastic",
          "nlsf viscoelastic",
          "nlsf viscous",
          "scalar function elastic",
          "scalar function elastic isotropic",
          "scalar function elastic orthotropic",
          "shock absorber",
          "symbolic elastic",
          "symbolic viscoelastic",
          "symbolic viscous",
          "turbulent viscoelastic"});
  refuse(r, "law", "law of solid elements",
         {"hookean linear elastic isotropic", "hookean linear viscoelastic isotropic",
          "mooney rivlin elastic", "neo hookean elastic", "neo hookean viscoelastic"});
  refuse(r, "file driver", "file driver", {"fixed step", "variable step", "socket", "stream"});
  refuse(r, "function", "scalar function",
         {"chebychev", "const", "cubic spline", "div", "exp", "linear", "log", "mul", "multilinear",
          "pow", "sub", "sum"});
  refuse(r, "fluid", "hydraulic fluid",
         {"exponential", "incompressible", "linear compressible", "linear thermal compressible",
          "super", "uncompressible"});
}

}  // namespace

void register_unsupported(Registry& registry) {
  refuse_elements(registry);
  refuse_types(registry);
  refuse_objects(registry);
}

}  // namespace mbcosim
