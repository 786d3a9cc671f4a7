/// Readers of `inertia` and `automatic structural`.
#include <set>
#include <utility>

#include "elements/bodies/inertia_report.h"
#include "elements/bodies/readers.h"
#include "model/card.h"

namespace mbcosim {

namespace {

/// `{ body | joint | user defined | loadable } , { all | <label> , … } , …`
std::vector<ElementRef> read_element_list(Card& card) {
  static constexpr Family kFamilies[] = {Family::body, Family::joint, Family::loadable,
                                         Family::loadable};
  std::vector<ElementRef> elements;
  std::set<std::pair<const ElementSet*, int>> known;
  const auto add = [&](const ElementRef& e) {
    if (!known.insert({e.set, e.index}).second)
      card.fail(card.model().element_text(e) + " is listed twice");
    elements.push_back(e);
  };
  Family family =
      kFamilies[card.required("element type", {"body", "joint", "user defined", "loadable"})];
  while (card.more() && card.peek_word() != "output") {
    if (const int k = card.one_of({"body", "joint", "user defined", "loadable"}); k >= 0) {
      family = kFamilies[k];
    } else if (card.keyword("all")) {
      for (const ElementRef& e : card.model().elements)
        if (e.set->info(e.index).family == family) add(e);
    } else {
      add(card.element(family));
    }
  }
  return elements;
}

void read_inertia(Card& card, ElementInfo& info) {
  const Vec3 x = card.keyword("position") ? card.absolute_position("position") : Vec3(Vec3::Zero());
  const Mat3 R = card.keyword("orientation") ? card.absolute_orientation("orientation")
                                             : Mat3(Mat3::Identity());
  auto report = std::make_unique<InertiaReport>(read_element_list(card), x, R);
  bool logged = true, always = false;
  while (card.keyword("output")) {
    const int word = card.required("output", {"no", "yes", "log", "both", "always"});
    if (word == 4)
      always = true;
    else
      logged = word != 0;
  }
  if (logged)
    card.model().log_lines.push_back(
        report->text(card.builder().input_context(), info.label, info.name));
  if (always) add_general_element(card.builder(), info, std::move(report));
}

/// b, g_m, ḃ, ġ_m of a dynamic node, global axes. Momenta follow from the bodies; the rates are
/// where the run starts.
void read_automatic_structural(Card& card, ElementInfo&) {
  const int index = card.structural_node(Card::NodeNeed::not_dummy);
  StructuralNode& node = card.model().structural[index];
  if (!node.has_momentum())
    card.fail("automatic structural: structural node " + std::to_string(node.label) + " is " +
              kind_name(node.kind) + "; a dynamic node is needed");
  const bool rotation = node.has_rotation();
  card.absolute_vector("momentum");
  if (rotation) card.absolute_vector("momenta moment");
  node.b_rate = card.absolute_vector("rate of the momentum");
  if (rotation) node.g_rate = card.absolute_vector("rate of the momenta moment");
}

}  // namespace

void register_inertia_cards(Registry& registry) {
  registry.element("inertia", Family::inertia, read_inertia);
  registry.element("automatic structural", Family::automatic_structural, read_automatic_structural,
                   false);
}

}  // namespace mbcosim
