/// Nodes, their degrees of freedom and elements named by label.
#include "input/cards.h"
#include "input/deck.h"
#include "input/deck_card.h"
#include "input/suggest.h"
#include "model/family.h"

namespace mbcosim {

int DeckCard::structural_node(NodeNeed need) {
  const int l = label("node label");
  const int node = deck_.builder.model().find_structural(l);
  if (node < 0) fail_undefined(last(), "structural node", l);
  const StructuralNode& n = deck_.builder.model().structural[node];
  const std::string name = "structural node " + std::to_string(l);
  if (need != NodeNeed::any && n.is_dummy()) fail(name + " is a dummy node: it has no equations");
  if (need == NodeNeed::six_dof && n.is_displacement())
    fail(name +
         " is a displacement node; a node with orientation (static or dynamic) is needed here");
  return node;
}

int DeckCard::scalar_node(ScalarKind kind) {
  const int l = label("node label");
  const int node = deck_.builder.model().find_scalar(kind, l);
  if (node < 0) fail_undefined(last(), kind_names(kind_of(kind)).singular, l);
  return node;
}

void DeckCard::read_order(NodeDof& dof, bool dynamic) {
  const SourceSpan where = more() ? next() : last();
  switch (one_of({"algebraic", "differential", "order"})) {
    case 0:
      dof.order = 0;
      return;
    case 1:
      dof.order = 1;
      return;
    case 2:
      break;
    default:
      fail_at(where,
              "\"algebraic\", \"differential\" or \"order\" expected after the node's degree of "
              "freedom",
              "", "wrong-argument");
  }
  dof.order = integer("order of the degree of freedom");
  if (dof.order < 0 || dof.order > (dynamic ? 2 : 1))
    fail("order " + std::to_string(dof.order) +
         " of the degree of freedom is not available; accepted: 0, 1" +
         (dynamic ? " or 2" : " (2 needs a dynamic structural node)"));
  if (dof.order == 0) keyword("algebraic");
}

NodeDof DeckCard::structural_dof(int l, SourceSpan where) {
  NodeDof dof;
  dof.structural = true;
  dof.node = deck_.builder.model().find_structural(l);
  if (dof.node < 0) fail_undefined(last(), "structural node", l);
  const StructuralNode& n = deck_.builder.model().structural[dof.node];
  if (n.is_dummy())
    fail_at(where, "structural node " + std::to_string(l) +
                       " is a dummy node: it has no degrees of freedom");
  const int size = n.kind == StructuralKind::modal ? 12 : n.position_unknowns();
  const int index = integer("index of the degree of freedom");
  if (index < 1 || index > size)
    fail("structural node " + std::to_string(l) + " has " + std::to_string(size) +
         " degrees of freedom; index " + std::to_string(index));
  dof.component = index - 1;
  return dof;
}

NodeDof DeckCard::node_dof(bool with_order) {
  const int l = label("node label");
  const SourceSpan where = last();
  const int type = required("node type", kNodeWords);
  if (type == 0) {
    NodeDof dof = structural_dof(l, where);
    const StructuralNode& n = deck_.builder.model().structural[dof.node];
    if (with_order)
      read_order(dof, n.has_momentum());
    else
      refuse_order("");
    return dof;
  }
  const ScalarKind kind = static_cast<ScalarKind>(type - 1);
  NodeDof dof;
  dof.node = deck_.builder.model().find_scalar(kind, l);
  if (dof.node < 0) fail_undefined(last(), kind_names(kind_of(kind)).singular, l);
  dof.differential =
      kind != ScalarKind::parameter && deck_.builder.model().scalars[dof.node].differential;
  if (with_order && dof.differential)
    read_order(dof, false);
  else
    refuse_order(dof.differential ? "" : "; the node is algebraic");
  return dof;
}

/// An order word where none is read would be taken for the next argument.
void DeckCard::refuse_order(const std::string& reason) {
  const std::string word = peek_word();
  if (word == "algebraic" || word == "differential")
    fail_at(next(),
            "\"" + word + "\" found; no order of the degree of freedom is written here" + reason);
}

ElementRef DeckCard::element(Family family) {
  const int l = label("element label");
  const ElementRef e = deck_.builder.model().find_element(family, l);
  if (!e.set) fail_undefined(last(), family_name(family), l);
  return e;
}

Family DeckCard::element_family(std::string_view what) {
  need_argument(what);
  const std::string w = peek_word();
  const auto head = registry().heads.find(w);
  if (head != registry().heads.end()) {
    skip();
    return head->second.family;
  }
  if (const FamilyFacts* const family = family_by_head(w)) {
    skip();
    return family->family;
  }
  std::vector<std::string> accepted;
  for (const FamilyFacts& f : all_families()) {
    if (keyword(f.name)) return f.family;
    accepted.emplace_back(f.name);
  }
  for (const auto& entry : registry().heads) accepted.push_back(entry.first);
  fail_at(next(), "unknown " + std::string(what) + (w.empty() ? "" : " \"" + w + "\""),
          suggestion(w, accepted), "unknown-word");
}

}  // namespace mbcosim
