#include "input/refusals.h"

#include "model/registry.h"

namespace mbcosim {

namespace {

void add(Refusals& r, const char* context, const std::string& word, const std::string& reason,
         const std::string& remedy, bool dead = true) {
  r[context][normalized(word)] = {word, reason, remedy, dead};
}

/// Words of documents and of the reader's lists behind which the reference solver has nothing.
void refuse_dead_joints(Refusals& r) {
  const char* const nothing = "the reference solver has no such joint";
  add(r, "joint", "plane displacement", "the reference solver reads it and stops",
      "use `in plane` and `revolute rotation`");
  add(r, "joint", "plane displacement pin", "the reference solver reads it and stops",
      "use `in plane` and `revolute rotation`");
  add(r, "joint", "coincidence", nothing, "use `total joint` with all components active");
  add(r, "joint", "kinematic", "the reference solver calls it obsolete",
      "use `total joint` or `total pin joint`");
  add(r, "joint", "gimbal hinge", nothing, "use `gimbal rotation`");
  add(r, "joint", "imposed kinematics", nothing, "use `total joint`");
  add(r, "joint", "offset displacement joint", nothing, "use `drive displacement`");
  add(r, "joint", "rotation", nothing, "use `revolute rotation` or `total joint`");
  add(r, "joint", "point surface contact", nothing, "use `point contact`");
}

void refuse_dead_elements(Refusals& r) {
  for (const char* word : {"absolute displacement", "absolute internal displacement", "abstract",
                           "abstract internal", "modal", "external modal", "external modal mapping",
                           "external structural", "external structural mapping", "total"})
    add(r, "couple", word, "it is a force, not a couple",
        std::string("write `force: <label>, ") + word + "`");
  for (const char* word : {"spring damper", "spring damper support", "cross spring damper",
                           "cross spring damper support"})
    add(r, "genel", word, "the reference solver has no such genel",
        "use `spring support` or `cross spring support` with a viscoelastic law");
  for (const char* word : {"full pipe", "full pipe new"})
    add(r, "hydraulic", word, "the reference solver has no such element",
        "use `pipe` or `dynamic pipe`");
  add(r, "hydraulic", "imposed pressure", "the reference solver has no such element",
      "use `genel: <label>, clamp` on the hydraulic node");
  add(r, "hydraulic", "imposed flow", "the reference solver has no such element",
      "use `force: <label>, abstract` on the hydraulic node");
  add(r, "elements", "loadable", "decks load no code",
      "what is built in is written `user defined: <label>, <word>`", false);
  add(r, "outputelement", "buffer stream", "it exchanges through the memory of another program",
      "use `stream`", false);
  add(r, "file driver", "buffer stream", "it exchanges through the memory of another program",
      "use `stream`", false);
}

void refuse_dead_objects(Refusals& r) {
  const char* const nothing = "the reference solver has no such law";
  add(r, "law", "linear elastic orthotropic", nothing, "use `linear elastic generic, diag`");
  add(r, "law", "symbolic elastic isotropic", nothing, "use `symbolic elastic`");
  for (const char* shape : {"isotropic", "orthotropic"})
    add(r, "law", std::string("scalar function viscoelastic ") + shape, nothing,
        std::string("use `scalar function elastic ") + shape + "`");
  for (const char* word : {"ann elastic", "ann viscoelastic"})
    add(r, "law", word, "its file has the format of an abandoned training tool",
        "use `symbolic elastic` or `scalar function elastic`", false);
  add(r, "law", "tdclw", "it is not documented", "", false);
  add(r, "drive", "sh", "the reference solver has no such drive", "use `sample and hold`");
  for (const char* word : {"octave", "derivative"})
    add(r, "drive", word, "decks run no foreign code", "use `string`", false);
  add(r, "drive", "ginac", "the reference solver is built without that library", "use `string`",
      false);
}

/// Words of run-time modules of the reference solver.
void refuse_modules(Refusals& r) {
  const char* const module = "it comes from a run-time module of the reference solver";
  const std::string none = "a deck loads no code";
  for (const char* word : {"switch", "multi step", "node distance", "smooth step"})
    add(r, "drive", word, module, none + "; use `string`", false);
  for (const char* word :
       {"hunt crossley", "continuous contact", "nonlinear rheologic damper", "hydraulic damper",
        "GRAALL damper", "damper gandhi", "muscle pennestri", "rolling bearing"})
    add(r, "law", word, module, none + "; use `symbolic viscoelastic`", false);
  for (const char* word : {"imu",
                           "imu constraint",
                           "load increment force",
                           "load increment normalization",
                           "gear joint",
                           "linear transmission joint",
                           "motion transmission joint",
                           "unilateral in plane",
                           "ball bearing contact",
                           "journal bearing",
                           "hydrodynamic_plain_bearing_with_offset",
                           "hydrodynamic bearing",
                           "resistor",
                           "capacitor",
                           "inductor",
                           "diode",
                           "switch",
                           "electrical source",
                           "ideal transformer",
                           "operational amplifier",
                           "bjt",
                           "proximity sensor",
                           "rigid ring tire",
                           "octave",
                           "FMU"})
    add(r, "userdefined", word, module,
        none + "; built in are `wheel2`, `inline friction` and `asynchronous_machine`", false);
}

}  // namespace

const Refusals& refusals() {
  static const Refusals all = [] {
    Refusals r;
    refuse_dead_joints(r);
    refuse_dead_elements(r);
    refuse_dead_objects(r);
    refuse_modules(r);
    return r;
  }();
  return all;
}

}  // namespace mbcosim
