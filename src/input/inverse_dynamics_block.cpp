/// `problem: inverse dynamics`: its block, the part that elements take in it, and what the model
/// must be. Source: MBDyn input manual, "Inverse dynamics".
#include <algorithm>
#include <set>

#include "input/cards.h"
#include "input/deck.h"
#include "model/inverse_problem.h"

namespace mbcosim {

namespace {

InverseProblem& problem_of(DeckCard& card) { return part<InverseProblem>(card.builder()); }

/// `weights`, w₁ and w₂ of the position, velocity and acceleration stages.
void read_weights(DeckCard& card) {
  InverseProblem& s = problem_of(card);
  if (!card.keyword("weights")) return;
  for (int stage = 0; stage < 3; ++stage) {
    s.change_weight[stage] = card.real_above("weight of the change", 0, true);
    s.inertia_weight[stage] = card.real_above("weight of the inertia", 0, true);
  }
}

void read_problem_type(DeckCard& card) {
  InverseProblem& s = problem_of(card);
  const int type =
      card.required("problem type",
                    {"fully actuated collocated", "underdetermined fully actuated",
                     "fully actuated non collocated", "underdetermined underactuated collocated"});
  if (type >= 2)
    card.fail("this type is not implemented in the reference solver",
              "use `fully actuated collocated` or `underdetermined fully actuated`",
              "not-supported");
  s.underdetermined = type == 1;
  if (s.underdetermined) read_weights(card);
}

void read_full_residual_test(DeckCard& card) {
  problem_of(card).full_residual_test = !card.more() || card.yes_no("full residual test");
  if (problem_of(card).full_residual_test)
    card.warn(
        "the rows of the nodes are balanced by multipliers that are thrown away: their "
        "residual stays large",
        "use it with `max iterations: <n>, at most` only");
}

void refuse_strategy(DeckCard& card) {
  if (card.required("strategy", {"no change", "factor", "change"}) != 0)
    card.fail("the records of inverse dynamics are one time step apart", "write `no change`");
}

/// Cards of `initial value` that mean the same here.
constexpr std::string_view kShared[] = {
    "initial time",     "final time",     "time step",      "min time step",
    "max time step",    "tolerance",      "max iterations", "modify residual test",
    "nonlinear solver", "newton raphson", "linear solver",  "solver",
    "threads",          "output",         "output meter",   "abort after",
    "real time"};

/// What a type of elements does; null: it cannot take part.
const InverseRole* role_of(const ElementInfo& info) {
  static const InverseRole kConstraint{true, true, false, false}, kLoad{false, false, false, true},
      kBody{false, false, true, true}, kNone{};
  static const std::set<std::string, std::less<>> kLoads = {
      "rod",
      "rod with offset",
      "rod bezier",
      "deformable hinge",
      "deformable displacement joint",
      "deformable joint",
      "deformable axial joint",
      "invariant deformable hinge",
      "invariant deformable displacement joint",
      "invariant deformable joint",
      "viscous body",
      "beam2",
      "absolute",
      "absolute internal",
      "follower",
      "follower internal",
      "conservative",
      "conservative internal",
      "total internal",
      "external structural"};
  switch (info.family) {
    case Family::joint:
      if (info.type == "clamp" || info.type == "total joint" || info.type == "total pin joint")
        return &kConstraint;
      break;
    case Family::body:
      return &kBody;
    case Family::gravity:
    case Family::inertia:
      return &kNone;
    case Family::joint_regularization:
      return info.type == "tikhonov" ? &kNone : nullptr;
    default:
      break;
  }
  const bool loads =
      info.family == Family::joint || info.family == Family::beam || info.family == Family::force;
  return loads && kLoads.count(info.type) ? &kLoad : nullptr;
}

bool is_constraint(const InverseRole& r) { return r.torque || r.prescribed; }

/// The words of the clause, in this order.
InverseRole read_clause(DeckCard& card, const ElementInfo& info, InverseRole r) {
  const bool constraint = is_constraint(r);
  r.torque = r.prescribed = false;
  if (info.family == Family::body) r.loads = r.ergonomy = false;
  const auto flag = [&](const char* word, bool& value) {
    if (card.keyword(word)) value = card.yes_no(word);
  };
  if (info.family == Family::joint) {
    flag("torque", r.torque);
    flag("prescribed motion", r.prescribed);
  }
  flag("right hand side", r.loads);
  flag("ergonomy", r.ergonomy);
  if (constraint && (r.ergonomy || r.loads))
    card.fail("a joint without a constitutive law has neither `ergonomy` nor `right hand side`");
  if (!constraint && is_constraint(r))
    card.fail("this joint has no constraints: neither `torque` nor `prescribed motion`");
  if (r.ergonomy && r.loads && info.family != Family::body)
    card.warn("both `ergonomy` and `right hand side`");
  if (!is_constraint(r) && !r.ergonomy && !r.loads) card.warn("takes no part in inverse dynamics");
  return r;
}

void report(Deck& deck, SourceSpan where, const std::string& message, const std::string& hint) {
  deck.reading.report(
      deck.reading.diagnostic(Severity::error, "inverse-dynamics", where, message, hint));
}

void check_nodes(Deck& deck) {
  for (const StructuralNode& n : deck.builder.model().structural)
    if (n.kind != StructuralKind::static_ && !n.is_dummy())
      report(deck, n.where,
             "structural node " + std::to_string(n.label) + ": a " + kind_name(n.kind) +
                 " node in inverse dynamics",
             "only static (and dummy) structural nodes are accepted");
  for (const ScalarNode& n : deck.builder.model().scalars)
    if (n.kind != ScalarKind::parameter)
      report(deck, n.where,
             std::string(kind_name(n.kind)) + " node " + std::to_string(n.label) +
                 " in inverse dynamics",
             "only static (and dummy) structural nodes are accepted");
}

/// Fully actuated: as many constraints as degrees of freedom, all of them prescribed.
void check_actuation(Deck& deck) {
  const Model& model = deck.builder.model();
  const InverseProblem& problem = part<InverseProblem>(deck.builder);
  int freedoms = 0, constraints = 0;
  for (const StructuralNode& n : model.structural) freedoms += n.position_unknowns();
  for (const ElementRef& e : model.elements) {
    const ElementInfo& info = e.set->info(e.index);
    if (info.family != Family::joint) continue;
    constraints += e.set->unknowns(e.index);
    if (e.set->unknowns(e.index) > 0 && !problem.role(info).prescribed)
      report(deck, info.where, model.element_text(e) + ": its motion is not prescribed",
             "all constraints of a `fully actuated collocated` problem prescribe motion; use "
             "`underdetermined fully actuated`");
  }
  if (freedoms != constraints)
    report(deck, {},
           "fully actuated inverse dynamics: the nodes have " + std::to_string(freedoms) +
               " degrees of freedom, the joints fix " + std::to_string(constraints),
           "prescribe each of them once, or use `problem type: underdetermined fully actuated`");
}

}  // namespace

void set_inverse_role(DeckCard& card, std::size_t before) {
  if (!card.deck().inverse_dynamics) return;
  const Model& model = card.model();
  for (std::size_t i = before; i < model.elements.size(); ++i) {
    const ElementInfo& info = model.elements[i].set->info(model.elements[i].index);
    const InverseRole* role = role_of(info);
    if (!role)
      card.fail_at(card.head(), "it cannot take part in inverse dynamics",
                   "accepted are clamp, total joint, total pin joint, rods, deformable joints, "
                   "viscous body, body, beam2, forces and couples");
    problem_of(card).roles[info.order] = *role;
  }
}

/// Decks of other problems may have the clause; it is checked and has no effect.
void read_inverse_role(DeckCard& card, std::size_t before) {
  if (!card.keyword("inverse dynamics")) return;
  const Model& model = card.model();
  if (before >= model.elements.size()) card.fail("`inverse dynamics` has no meaning here");
  const ElementInfo& info = model.elements[before].set->info(model.elements[before].index);
  const InverseRole* role = role_of(info);
  const InverseRole read = read_clause(card, info, role ? *role : InverseRole{});
  if (card.deck().inverse_dynamics) problem_of(card).roles[info.order] = read;
}

std::vector<std::string> inverse_dynamics_words() {
  std::vector<std::string> words(std::begin(kShared), std::end(kShared));
  words.insert(words.end(), {"problem type", "strategy", "full residual test"});
  return words;
}

void read_inverse_dynamics_card(DeckCard& card) {
  const std::string& word = card.statement().word;
  if (word == "problemtype")
    read_problem_type(card);
  else if (word == "fullresidualtest")
    read_full_residual_test(card);
  else if (word == "strategy")
    refuse_strategy(card);
  else if (std::any_of(std::begin(kShared), std::end(kShared),
                       [&](std::string_view w) { return normalized(w) == word; }))
    return read_initial_value_card(card);
  else
    fail_unknown_card(card, inverse_dynamics_words());
  card.expect_end();
}

void finish_inverse_dynamics(Deck& deck) {
  InverseProblem& problem = part<InverseProblem>(deck.builder);
  check_nodes(deck);
  if (!problem.underdetermined) check_actuation(deck);
  const Model& model = deck.builder.model();
  problem.memory = deck.builder.allocate_memory(6 * static_cast<int>(model.structural.size()));
  int constraints = 0;
  for (const ElementRef& e : model.elements)
    if (e.set->info(e.index).family == Family::joint) constraints += e.set->unknowns(e.index);
  problem.multipliers = deck.builder.allocate_memory(constraints);
}

}  // namespace mbcosim
