/// Named objects that a deck may define in any block: frames, drives, laws, functions, fluids.
#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "input/cards.h"
#include "input/deck.h"
#include "model/drive_trace.h"
#include "model/model_part.h"

namespace mbcosim {

namespace {

/// Label of a new object of `kind`, refused when `map` has it.
template <class Map>
int new_label(DeckCard& card, const Map& map, const char* kind) {
  card.set_defining(kind);
  const int label = card.label(std::string(kind) + " label");
  card.set_defining(kind, label);
  const auto found = map.find(label);
  if (found != map.end()) card.deck().redefined(card, kind, label, found->second.where);
  card.set_subject(std::string(kind) + " " + std::to_string(label));
  return label;
}

// ------------------------------------------------------------------------------------------------
// reference

void read_denavit_hartenberg(DeckCard& card, ReferenceFrame& f) {
  ReferenceFrame base;
  if (card.keyword("reference") && !card.keyword("global")) {
    const int l = card.label("reference frame label");
    const auto found = card.deck().frames.find(l);
    if (found == card.deck().frames.end()) card.fail_undefined(card.last(), "reference frame", l);
    base = card.model().frames[found->second];
  }
  const double d = card.real("d"), theta = card.real("theta"), a = card.real("a"),
               alpha = card.real("alpha");
  const Mat3 turn = rotation_z(theta);
  f.x = base.x + base.R * (Vec3(0, 0, d) + turn * Vec3(a, 0, 0));
  f.R = base.R * turn * rotation_x(alpha);
  f.v = base.v + base.w.cross(f.x - base.x);
  f.w = base.w;
}

void read_reference(DeckCard& card) {
  Deck& deck = card.deck();
  card.set_defining("reference frame");
  ReferenceFrame f;
  f.label = card.label("reference frame label");
  card.set_defining("reference frame", f.label);
  if (const auto found = deck.frames.find(f.label); found != deck.frames.end())
    deck.redefined(card, "reference frame", f.label, card.model().frames[found->second].where);
  card.set_subject("reference frame " + std::to_string(f.label));
  f.where = card.head();
  f.name = card.optional_name();
  if (card.keyword("denavit hartenberg")) {
    read_denavit_hartenberg(card, f);
  } else {
    card.keyword("position");
    f.x = card.absolute_position("position");
    card.keyword("orientation");
    f.R = card.absolute_orientation("orientation");
    if (card.more()) {
      card.keyword("velocity");
      f.v = card.absolute_velocity("velocity", f.x);
    }
    if (card.more()) {
      card.keyword("angular velocity");
      f.w = card.absolute_angular_velocity("angular velocity");
    }
  }
  card.expect_end();
  deck.frames[f.label] = card.model().frames.size();
  card.model().frames.push_back(std::move(f));
}

// ------------------------------------------------------------------------------------------------
// drives

/// A bare `yes` adds the derivative where there is one. True: it is told whether the value is
/// written.
bool read_drive_output(DeckCard& card, NamedDrive& d) {
  bool told = false;
  while (card.keyword("output")) {
    bool named = true;
    do {
      switch (card.one_of({"value", "derivative"})) {
        case 0:
          d.output_value = card.yes_no("output of the value");
          told = true;
          break;
        case 1:
          d.output_derivative = card.yes_no("output of the derivative");
          break;
        default:
          d.output_value = card.yes_no("output");
          d.output_derivative = d.output_value && d.drive->has_derivative();
          told = true;
          named = false;
      }
    } while (named && (card.peek_word() == "value" || card.peek_word() == "derivative"));
  }
  return told;
}

void drop_missing_derivative(DeckCard& card, const Drive& drive, bool& wanted) {
  if (!wanted || drive.has_derivative()) return;
  card.warn("this drive has no derivative to write");
  wanted = false;
}

/// `output trace, {value, {yes|no} [, derivative, {yes|no}] | {yes|no}}`: a bare `yes` adds the
/// derivative where there is one.
void read_drive_trace(DeckCard& card, const NamedDrive& d) {
  if (!card.keyword("output trace")) return;
  DriveTraces::Trace trace{d.label, d.drive, false, false};
  if (card.keyword("value")) {
    trace.value = card.yes_no("trace of the value");
    if (card.keyword("derivative")) trace.derivative = card.yes_no("trace of the derivative");
  } else {
    trace.value = card.yes_no("output trace");
    trace.derivative = trace.value && d.drive->has_derivative();
  }
  drop_missing_derivative(card, *d.drive, trace.derivative);
  if (!trace.value && !trace.derivative) return;
  std::vector<DriveTraces::Trace>& traces = part<DriveTraces>(card.builder()).traces;
  const auto place =
      std::upper_bound(traces.begin(), traces.end(), d.label,
                       [](int label, const DriveTraces::Trace& t) { return label < t.label; });
  traces.insert(place, std::move(trace));
}

void read_drive_caller(DeckCard& card) {
  Deck& deck = card.deck();
  NamedDrive d;
  d.label = new_label(card, deck.drives, "drive caller");
  d.name = card.optional_name();
  card.keyword("deferred");
  d.drive = card.drive();
  const bool output_is_told = read_drive_output(card, d);
  drop_missing_derivative(card, *d.drive, d.output_derivative);
  read_drive_trace(card, d);
  card.expect_end();
  d.evaluations = card.weight().objects;
  deck.drives[d.label] = {d.drive, card.head(), card.weight()};
  const int index = static_cast<int>(card.model().drives.size());
  card.model().drive_index[d.label] = index;
  if (!output_is_told) deck.drives_without_output.push_back(index);
  card.model().drives.push_back(std::move(d));
}

void read_template_drive_caller(DeckCard& card) {
  Deck& deck = card.deck();
  card.set_defining("template drive caller");
  const int label = card.label("template drive caller label");
  card.set_defining("template drive caller", label);
  card.set_subject("template drive caller " + std::to_string(label));
  card.optional_name();
  const std::string_view text = card.next_text();
  std::string shape(text == "3x3" || text == "6x6" ? text : "");
  if (!shape.empty())
    card.skip();
  else
    shape = card.at_string() ? card.quoted("dimension") : std::to_string(card.integer("dimension"));
  const auto store = [&](auto& map, auto read) {
    if (const auto found = map.find(label); found != map.end())
      deck.redefined(card, "template drive caller", label, found->second.where);
    auto drive = read();
    card.expect_end();
    map[label] = {std::move(drive), card.head(), card.weight()};
  };
  if (shape == "1")
    store(deck.drives1, [&] { return card.scalar_template_drive("template drive"); });
  else if (shape == "3")
    store(deck.drives3, [&] { return card.vec3_drive(); });
  else if (shape == "6")
    store(deck.drives6, [&] { return card.vec6_drive(); });
  else if (shape == "3x3")
    store(deck.drives33, [&] { return card.mat3_drive("matrix drive"); });
  else if (shape == "6x6")
    store(deck.drives66, [&] { return card.mat6_drive("matrix drive"); });
  else
    card.fail("unknown dimension \"" + shape + "\"; accepted: 1, 3, 6, \"3x3\", \"6x6\"", "",
              "unknown-word");
}

// ------------------------------------------------------------------------------------------------
// laws, functions, fluids

void read_constitutive_law(DeckCard& card) {
  Deck& deck = card.deck();
  card.set_defining("constitutive law");
  const int label = card.label("constitutive law label");
  card.set_defining("constitutive law", label);
  card.set_subject("constitutive law " + std::to_string(label));
  card.optional_name();
  const int dimension = card.integer("dimension");
  const auto store = [&](auto& map, auto read) {
    if (const auto found = map.find(label); found != map.end())
      deck.redefined(card, "constitutive law", label, found->second.where);
    auto law = read();
    card.expect_end();
    map[label] = {std::move(law), card.head(), card.weight()};
  };
  if (dimension == 1)
    store(deck.laws1, [&] { return card.law1(); });
  else if (dimension == 3)
    store(deck.laws3, [&] { return card.law3(); });
  else if (dimension == 6)
    store(deck.laws6, [&] { return card.law6(); });
  else
    card.fail("dimension " + std::to_string(dimension) + " is not accepted; accepted: 1, 3, 6");
}

void read_scalar_function(DeckCard& card) {
  card.read_function_definition();
  card.expect_end();
}

void read_hydraulic_fluid(DeckCard& card) {
  Deck& deck = card.deck();
  const int label = new_label(card, deck.fluids, "hydraulic fluid");
  card.optional_name();
  if (card.peek_word() == "reference")
    card.fail_at(card.next(), "a hydraulic fluid cannot refer to another one");
  FluidPtr fluid = card.fluid_definition();
  card.expect_end();
  deck.fluids[label] = {std::move(fluid), card.head(), card.weight()};
}

/// Read for its form; only aerodynamic elements would use it.
void read_c81_data(DeckCard& card) {
  const int label = new_label(card, card.deck().c81_data, "c81 data");
  card.optional_name();
  card.file_contents("file of c81 data", nullptr);
  if (card.keyword("tolerance")) card.real_above("tolerance", 0, false);
  card.one_of({"fc511", "nrel", "free format"});
  card.keyword("flip");
  if (card.keyword("echo")) {
    card.quoted("file of the echo");
    card.keyword("free format");
  }
  card.expect_end();
  card.deck().c81_data[label] = {true, card.head()};
  card.warn("without effect: aerodynamic elements are not supported yet");
}

/// "libs/libmodule-wheel2.la" -> "wheel2".
std::string module_name(std::string file) {
  if (const std::size_t slash = file.rfind('/'); slash != std::string::npos)
    file.erase(0, slash + 1);
  for (const char* suffix : {".la", ".so"})
    if (file.ends_with(suffix)) file.erase(file.size() - 3);
  for (const char* prefix : {"lib", "module-"})
    if (file.starts_with(prefix)) file.erase(0, std::string_view(prefix).size());
  return file;
}

void read_module_load(DeckCard& card) {
  const std::string name = module_name(card.quoted("name of the module"));
  const SourceSpan where = card.last();
  for (const char* known : {"wheel2", "inline_friction", "asynchronous_machine", "minmaxdrive"}) {
    if (name != known) continue;
    while (card.more()) card.skip();  // arguments of the module
    card.note("the words of \"" + name + "\" are built in; nothing is loaded");
    return;
  }
  card.fail_at(where, "module \"" + name + "\" is not served: decks load no code",
               "built in are the words of wheel2, inline_friction, asynchronous_machine and "
               "minmaxdrive");
}

}  // namespace

bool read_anywhere_card(DeckCard& card) {
  static const std::map<std::string, void (*)(DeckCard&), std::less<>> kCards = {
      {"reference", read_reference},
      {"drivecaller", read_drive_caller},
      {"templatedrivecaller", read_template_drive_caller},
      {"constitutivelaw", read_constitutive_law},
      {"scalarfunction", read_scalar_function},
      {"hydraulicfluid", read_hydraulic_fluid},
      {"c81data", read_c81_data},
      {"moduleload", read_module_load},
  };
  const auto found = kCards.find(card.statement().word);
  if (found == kCards.end()) return false;
  found->second(card);
  return true;
}

}  // namespace mbcosim
