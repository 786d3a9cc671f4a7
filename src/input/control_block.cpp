/// Cards of the `control data` block (MBDyn input manual, "Control data").
#include <map>

#include "input/cards.h"
#include "input/deck.h"
#include "input/suggest.h"
#include "model/family.h"
#include "model/model_part.h"
#include "model/netcdf_sync.h"
#include "model/printed_dofs.h"
#include "model/unit_system.h"
#include "model/user_elements.h"

namespace mbcosim {

namespace {

ControlSettings& control(DeckCard& card) { return card.model().control; }

// ------------------------------------------------------------------------------------------------
// assembly

void read_skip_assembly(DeckCard& card) { control(card).skip_assembly = true; }

/// What a deck may call into the initial assembly. Elastic joints and beams take part anyhow.
void read_use(DeckCard& card) {
  bool closed = false;
  while (card.more() && !closed) {
    const SourceSpan where = card.next();
    switch (card.required("kind of element",
                          {"beams", "loadable elements", "in assembly", "forces", "rigid bodies",
                           "gravity", "plates", "aerodynamic elements"})) {
      case 0:
        break;
      case 1:
        part<UserElementsInAssembly>(card.builder());
        break;
      case 2:
        closed = true;
        break;
      case 3:
        control(card).assemble_forces = true;
        break;
      default:
        card.warn_at(where, "without effect: these elements take no part in the initial assembly",
                     "constraints and what is elastic place the nodes");
    }
  }
  if (!closed) card.fail("\"in assembly\" missing at the end of the card");
}

void read_initial_stiffness(DeckCard& card) {
  ControlSettings& c = control(card);
  c.position_stiffness = c.velocity_stiffness = 1;
  if (!card.more()) return;
  c.position_stiffness = c.velocity_stiffness = card.real("position stiffness", 1);
  if (card.more()) c.velocity_stiffness = card.real("velocity stiffness", 1);
  if (c.position_stiffness < 0 || c.velocity_stiffness < 0)
    card.fail("initial stiffness must not be negative");
}

void read_omega_rotates(DeckCard& card) {
  control(card).omega_rotates = card.required("omega rotates", {"yes", "no"}) == 0;
}

void read_assembly_tolerance(DeckCard& card) {
  control(card).assembly_tolerance = card.real("tolerance", 1e-6);
  if (!(control(card).assembly_tolerance > 0))
    card.fail("the tolerance of the initial assembly must be greater than 0");
}

void read_assembly_iterations(DeckCard& card) {
  const int n = card.integer("max iterations", 1);
  if (n < 1) card.warn("max iterations is less than 1, 1 is used");
  control(card).assembly_max_iterations = std::max(1, n);
}

void read_epsilon(DeckCard& card) {
  control(card).assembly_epsilon = card.real_above("epsilon", 0, false);
}

// ------------------------------------------------------------------------------------------------
// output

/// Words of `default output`: the count names of nodes and elements that have a file of their own.
void set_default_output(OutputDefaults& o, bool on) {
  const bool accelerations = o.accelerations;
  o = OutputDefaults();
  o.structural = on;
  o.scalar.fill(on);
  o.family.fill(on);
  o.accelerations = accelerations;
}

bool has_default_output(Kind kind) {
  if (kind == Kind::parameter_node || kind == Kind::file_driver) return false;
  for (const FamilyFacts& f : all_families())
    if (kind == kind_of(f.family)) return f.has_default_output;
  return true;
}

void switch_on(OutputDefaults& o, Kind kind) {
  if (kind == Kind::structural_node)
    o.structural = true;
  else if (kind < Kind::file_driver)
    o.scalar[static_cast<int>(kind) - 1] = true;
  else
    o.family[static_cast<int>(kind) - static_cast<int>(Kind::family0)] = true;
}

void read_default_output(DeckCard& card) {
  Deck& deck = card.deck();
  while (card.more()) {
    switch (card.one_of({"all", "none", "reference frames", "accelerations", "drive callers"})) {
      case 0:
        set_default_output(deck.output, true);
        continue;
      case 1:
        set_default_output(deck.output, false);
        continue;
      case 2:
        control(card).output_reference_frames = true;
        continue;
      case 3:
        deck.output.accelerations = true;
        continue;
      case 4:
        control(card).output_drives = true;
        continue;
      default:
        break;
    }
    const std::string word = card.word("output item");
    const std::optional<Kind> kind = kind_of_count_card(word);
    if (kind && has_default_output(*kind)) {
      switch_on(deck.output, *kind);
      continue;
    }
    std::vector<std::string> known = {"all", "none", "reference frames", "accelerations",
                                      "drive callers"};
    for (int k = 0; k < kKinds; ++k) known.emplace_back(kind_names(static_cast<Kind>(k)).card);
    card.warn("unknown item \"" + word + "\" ignored", suggestion(word, known));
  }
}

void read_output_frequency(DeckCard& card) {
  Deck& deck = card.deck();
  if (deck.output_rate_set)
    card.fail_at(card.head(), "output frequency or output meter is given twice");
  deck.output_rate_set = true;
  control(card).output_frequency = card.integer_at_least("output frequency", 1);
}

void read_meter_of_all(DeckCard& card) {
  Deck& deck = card.deck();
  if (deck.output_rate_set)
    card.fail_at(card.head(), "output frequency or output meter is given twice");
  deck.output_rate_set = true;
  control(card).output_meter = card.drive("output meter");
}

void read_output_precision(DeckCard& card) {
  const int n = card.integer_at_least("output precision", 1);
  if (n > 17) card.warn("more than 17 digits mean nothing, 17 are written");
  control(card).output_precision = std::min(n, 17);
}

void read_default_orientation(DeckCard& card) {
  control(card).orientation = card.orientation_description();
}

void read_output_flags(DeckCard& card) {
  std::set<std::string> seen;
  while (card.more()) {
    const std::string flag = card.word("output flag");
    if (!seen.insert(flag).second) card.fail("flag \"" + flag + "\" is given twice");
  }
}

void read_default_beam_output(DeckCard& card) {
  card.deck().beam_output = read_beam_output(card, "default beam output", true);
  if (card.more())
    card.fail_at(card.next(), "default beam output: unknown flag",
                 "accepted: those of a beam's `custom output`, e.g. forces, strains, all");
}

void read_output_results(DeckCard& card) {
  ControlSettings& c = control(card);
  const int format = card.required("result format", {"netcdf", "text", "adams", "motion view"});
  if (format == 1) return;
  if (format >= 2)
    card.fail("this format is written by special builds of the reference solver only",
              "write `output results: netcdf`", "not-supported");
  c.netcdf = true;
  while (card.more()) {
    const int option =
        card.required("option", {"sync", "no sync", "no text", "text", "classic", "netcdf4"});
    if (option <= 1) part<NetcdfSync>(card.builder()).on = option == 0;
    if (option == 2)
      card.warn("`no text` is ignored: the text files are written beside the NetCDF file",
                "`mbcosim run --format netcdf` writes the NetCDF file alone");
  }
}

void read_title(DeckCard& card) { card.model().title = card.quoted("title"); }

void read_units(DeckCard& card) {
  UnitSystem& units = part<UnitSystem>(card.builder());
  if (!units.length.empty()) card.fail_at(card.head(), "units are given twice");
  card.required("quantity", {"length"});
  units.length = card.quoted("unit of length");
  const bool by_force = card.required("quantity", {"mass", "force"}) == 1;
  (by_force ? units.force : units.mass) = card.quoted(by_force ? "unit of force" : "unit of mass");
  card.required("quantity", {"time"});
  units.time = card.quoted("unit of time");
  if (const auto fault = check(units))
    card.fail_at(card.head(), std::string("units: ") + fault->member + " " + fault->text);
}

void read_print(DeckCard& card) {
  PrintedDofs& p = part<PrintedDofs>(card.builder());
  while (card.more()) {
    const int item = card.required(
        "item", {"dof stats", "dof description", "equation description", "description",
                 "element connection", "node connection", "connection", "all", "none", "to file"});
    const bool all = item == 7;
    p.statistics |= all || item == 0;
    p.dofs |= all || item == 1 || item == 3;
    p.equations |= all || item == 2 || item == 3;
    p.element_connections |= all || item == 4 || item == 6;
    p.node_connections |= all || item == 5 || item == 6;
    p.to_file |= item == 9;
    if (item == 8) p = {.to_file = p.to_file};
  }
}

void read_select_timeout(DeckCard& card) {
  if (!card.keyword("forever")) card.integer_at_least("select timeout", 0);
}

// ------------------------------------------------------------------------------------------------
// other

void read_default_scale(DeckCard& card) {
  Deck& deck = card.deck();
  std::vector<std::string> known = {"all"};
  for (int k = 0; k < kKinds; ++k) known.emplace_back(kind_names(static_cast<Kind>(k)).card);
  while (card.more()) {
    const std::string owner = card.word("owner of degrees of freedom");
    const double s = card.equation_scale();
    const bool all = owner == "all";
    const std::optional<Kind> kind = kind_of_count_card(owner);
    if (!all && !kind) {
      card.warn("unknown owner \"" + owner + "\" ignored", suggestion(owner, known));
      continue;
    }
    if (all || *kind == Kind::structural_node) deck.structural_scale = s;
    for (int k = 0; k < 5; ++k)
      if (all || *kind == kind_of(static_cast<ScalarKind>(k))) deck.scalar_scale[k] = s;
    for (int f = 0; f < kFamilies; ++f)
      if (all || *kind == kind_of(static_cast<Family>(f))) card.model().family_scale[f] = s;
  }
}

void read_model(DeckCard& card) {
  card.required("model", {"static"});
  control(card).is_static = true;
}

void read_frame_motion(DeckCard& card) {
  FrameMotion m;
  const bool constant = card.required("kind of rigid body kinematics", {"const", "drive"}) == 0;
  m.in_absolute_axes = !constant;
  bool any = false;
  const auto vector = [&](const char* word, Vec3DrivePtr& drive) {
    if (!card.keyword(word)) return;
    any = true;
    drive = constant ? make_constant_vec3_drive(card.absolute_vector(word)) : card.vec3_drive(word);
  };
  vector("position", m.position);
  if (card.keyword("orientation")) {
    any = true;
    m.orientation =
        constant
            ? make_constant_vec3_drive(vector_of_rotation(card.absolute_orientation("orientation")))
            : card.vec3_drive("orientation");
  }
  vector("velocity", m.velocity);
  vector("angular velocity", m.angular_velocity);
  vector("acceleration", m.acceleration);
  vector("angular acceleration", m.angular_acceleration);
  card.expect_end();
  if (any)
    card.model().frame_motion = std::move(m);
  else
    card.warn_at(card.head(), "rigid body kinematics: no data, the card is ignored");
}

void read_gravity_flag(DeckCard& card) {
  card.deck().counts[static_cast<int>(kind_of(Family::gravity))].declared = 1;
}
void read_air_flag(DeckCard& card) {
  card.deck().counts[static_cast<int>(kind_of(Family::air_properties))].declared = 1;
}

void read_restart(DeckCard& card) {
  switch (card.one_of({"iterations", "time", "times"})) {
    case 0:
      card.integer_at_least("iterations between two restart files", 1);
      break;
    case 1:
      card.real_above("time between two restart files", 0, false);
      break;
    case 2: {
      const int count = card.integer_at_least("number of restart files", 1);
      for (int k = 0; k < count; ++k) card.real("time of a restart file");
      break;
    }
    default:
      break;
  }
  card.keyword("with solution array");
  card.warn_at(card.head(), "restart files are not written",
               "snapshots of the service (`CreateSnapshot`) keep a run, and its checkpoints");
}
void read_automatic_differentiation(DeckCard& card) {
  card.note("derivatives are exact with and without this card");
}
void read_solution_array(DeckCard& card) {
  card.fail_at(card.head(),
               "\"read solution array\" is not served: the file depends on the machine and "
               "the build that wrote it",
               "restore a snapshot of the service instead", "not-supported");
}
void read_output_file_name(DeckCard& card) {
  card.fail_at(card.head(), "\"output file name\" is obsolete",
               "give the name on the command line: -o PREFIX");
}
void read_refused_count(DeckCard& card) {
  card.fail_at(card.head(),
               "\"" + card.card_name() + "\" is not served: the reference solver refuses it, too",
               "remove the card: there is nothing to count", "not-supported");
}

using Reader = void (*)(DeckCard&);
const std::vector<std::pair<const char*, Reader>>& control_cards() {
  static const std::vector<std::pair<const char*, Reader>> kCards = {
      {"skip initial joint assembly", read_skip_assembly},
      {"use", read_use},
      {"initial stiffness", read_initial_stiffness},
      {"stiffness", read_initial_stiffness},
      {"omega rotates", read_omega_rotates},
      {"tolerance", read_assembly_tolerance},
      {"initial tolerance", read_assembly_tolerance},
      {"max iterations", read_assembly_iterations},
      {"max initial iterations", read_assembly_iterations},
      {"epsilon", read_epsilon},
      {"linear solver", read_linear_solver},
      {"solver", read_linear_solver},
      {"default output", read_default_output},
      {"output frequency", read_output_frequency},
      {"output meter", read_meter_of_all},
      {"output precision", read_output_precision},
      {"default orientation", read_default_orientation},
      {"default beam output", read_default_beam_output},
      {"default aerodynamic output", read_output_flags},
      {"output results", read_output_results},
      {"title", read_title},
      {"print", read_print},
      {"make restart file", read_restart},
      {"select timeout", read_select_timeout},
      {"default scale", read_default_scale},
      {"model", read_model},
      {"rigid body kinematics", read_frame_motion},
      {"loadable path", ignore_card},
      {"finite difference jacobian meter", ignore_card},
      {"use automatic differentiation", read_automatic_differentiation},
      {"output units", ignore_card},
      {"units", read_units},
      {"read solution array", read_solution_array},
      {"output file name", read_output_file_name},
      {"gravity", read_gravity_flag},
      {"air properties", read_air_flag},
      {"automatic structural elements", ignore_card},
      {"driven elements", read_refused_count},
      {"electric bulk elements", read_refused_count},
  };
  return kCards;
}

/// Reads a count card; false when the word is none.
bool read_count(DeckCard& card) {
  const std::optional<Kind> kind = kind_of_count_card(card.statement().word);
  if (!kind || *kind == kind_of(Family::gravity) || *kind == kind_of(Family::air_properties))
    return false;
  for (const FamilyFacts& f : all_families())
    if (*f.old_count_card && card.statement().word == f.old_count_card)
      warn_old_name(card, card.head(), kind_names(*kind).card);
  Count& count = card.deck().counts[static_cast<int>(*kind)];
  count.where = card.head();
  count.declared = card.more() ? card.count("count") : 0;
  return true;
}

}  // namespace

std::vector<std::string> control_words() {
  std::vector<std::string> words;
  for (const auto& c : control_cards()) words.emplace_back(c.first);
  for (int k = 0; k < kKinds; ++k) {
    const std::string count = kind_names(static_cast<Kind>(k)).card;
    if (!count.empty()) words.push_back(count);
  }
  return words;
}

void read_control_card(DeckCard& card) {
  if (read_count(card)) {
    card.expect_end();
    return;
  }
  static const std::map<std::string, Reader, std::less<>> kReaders = [] {
    std::map<std::string, Reader, std::less<>> m;
    for (const auto& c : control_cards()) m[normalized(c.first)] = c.second;
    return m;
  }();
  const auto found = kReaders.find(card.statement().word);
  if (found == kReaders.end()) {
    fail_unknown_card(card, control_words());
  }
  if (found->first == "solver") warn_old_name(card, card.head(), "linear solver");
  found->second(card);
  card.expect_end();
}

}  // namespace mbcosim
