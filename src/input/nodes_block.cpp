/// Cards of the `nodes` block: scalar nodes, the `output` card.
#include <cmath>

#include "input/cards.h"
#include "input/deck.h"
#include "input/model_functions.h"
#include "model/drive.h"

namespace mbcosim {

namespace {

/// Value of a parameter node that samples a degree of freedom every `period` seconds and holds it
/// in between: 0 until the first period is over; in a step that samples, the value of the iterate.
class SampleAndHold final : public Drive, public StepListener {
 public:
  enum Memory { next_time, is_sampling, kMemory };
  /// `held`: memory slot of the value; `memory`: the first of kMemory others.
  SampleAndHold(NodeDof dof, double period, int held, int memory)
      : dof_(dof), period_(period), held_(held), memory_(memory) {}
  using Drive::value;
  double value(const EvalContext& context, double) const override {
    const State& state = *context.state;
    return state.memory[memory_ + is_sampling] != 0 ? context.model->dof_value(context, dof_)
                                                    : state.memory[held_];
  }
  void advance(const EvalContext& context, State& state, bool initial) const override {
    state.memory[held_] = value(context, context.time);  // of the step before
    double &next = state.memory[memory_ + next_time],
           &sampling = state.memory[memory_ + is_sampling];
    if (initial) next = context.time + period_;
    sampling = context.time < next - 1e-9 * period_ ? 0 : 1;
    if (sampling != 0)
      next += period_ * std::max(1.0, std::floor((context.time - next) / period_ + 1 + 1e-9));
  }

 private:
  NodeDof dof_;
  double period_;  ///< [s]
  int held_, memory_;
};

/// `[ value , ] x [ , derivative , xp ]`; nothing at all is 0.
void read_initial_value(DeckCard& card, ScalarNode& node, bool derivative) {
  const std::string w = card.peek_word();
  if (!card.more() || w == "output" || w == "scale") return;
  card.keyword("value");
  node.value = card.real("value");
  if (!card.keyword("derivative")) return;
  if (!derivative) card.fail("only a differential node has a derivative");
  node.rate = card.real("derivative");
}

struct Sampling {
  NodeDof dof;
  double period = 0;  ///< 0: none
};

Sampling read_parameter(DeckCard& card, ScalarNode& node) {
  Sampling sampling;
  node.differential = false;
  switch (card.one_of({"element", "sample and hold", "beam strain gage"})) {
    case 0:
      node.bound_to_element = true;
      break;
    case 1:
      sampling.dof = card.node_dof(false);
      sampling.period = card.real_above("period", 0, false);
      break;
    case 2:
      node.bound_to_element = true;
      node.gage = 1;
      node.gage_y = card.real("y");
      node.gage_z = card.real("z");
      break;
    default:
      read_initial_value(card, node, false);
  }
  return sampling;
}

/// The card switches on the lines of `.mov`; those of `.ine`, which the node's own card and
/// `default output` switch on with them, it switches off, as MBDyn does, but for displacement
/// nodes.
void read_nodes_output(DeckCard& card) {
  const int type = card.required("node type", kNodeWords);
  Model& model = card.model();
  const bool accelerations = type == 0 && card.keyword("accelerations");
  const auto mark_structural = [&](StructuralNode& node) {
    node.output = true;
    if (!node.is_displacement()) node.output_inertia = false;
    node.accelerations |= accelerations;
  };
  const std::string kind =
      std::string(type == 0 ? "structural" : kind_name(static_cast<ScalarKind>(type - 1))) +
      " node";
  read_output_labels(card, [&](int first, int last) {
    if (first == last) {
      const int index = type == 0 ? model.find_structural(first)
                                  : model.find_scalar(static_cast<ScalarKind>(type - 1), first);
      if (index < 0) {
        if (!card.deck().was_refused(kind, first)) card.warn(undefined_text(kind, first));
      } else if (type == 0) {
        mark_structural(model.structural[index]);
      } else {
        model.scalars[index].output = true;
      }
      return;
    }
    const auto in_range = [&](int label) { return label >= first && label <= last; };
    if (type == 0) {
      for (StructuralNode& node : model.structural)
        if (in_range(node.label)) mark_structural(node);
    } else {
      for (ScalarNode& node : model.scalars)
        if (node.kind == static_cast<ScalarKind>(type - 1) && in_range(node.label))
          node.output = true;
    }
  });
  card.expect_end();
}

template <class Node, class Existing>
int begin_node(DeckCard& card, Kind kind, Node& node, Existing existing,
               SourceSpan where(const Model&, int)) {
  const char* name = kind_names(kind).singular;
  card.set_defining(name);
  card.set_subject(name);
  const int label = card.label("label");
  card.set_defining(name, label);
  card.set_subject("");
  if (const int index = existing(card.model(), label); index >= 0)
    card.deck().redefined(card, name, label, where(card.model(), index));
  card.deck().count_entity(card, kind, label);
  card.set_subject(std::string(name) + " " + std::to_string(label));
  node.where = card.head();
  node.name = card.optional_name();
  return label;
}

void read_scalar_card(DeckCard& card, ScalarKind kind) {
  ScalarNode node;
  node.kind = kind;
  node.label = begin_node(
      card, kind_of(kind), node, [kind](const Model& m, int l) { return m.find_scalar(kind, l); },
      [](const Model& m, int i) { return m.scalars[i].where; });
  read_scalar_node(card, kind, std::move(node));
}

}  // namespace

void read_scalar_node(DeckCard& card, ScalarKind kind, ScalarNode node) {
  Deck& deck = card.deck();
  const int k = static_cast<int>(kind);
  node.output = deck.output.scalar[k];
  node.scale = deck.scalar_scale[k];
  Sampling sampling;
  if (kind == ScalarKind::parameter) {
    sampling = read_parameter(card, node);
  } else {
    node.differential = kind != ScalarKind::hydraulic;
    if (kind == ScalarKind::abstract)
      node.differential = card.one_of({"differential", "algebraic"}) != 1;
    read_initial_value(card, node, node.differential);
    if (card.keyword("scale"))
      node.scale = card.keyword("default") ? deck.scalar_scale[k] : card.equation_scale();
  }
  read_output_option(card, deck.output.scalar[k], node.output);
  card.expect_end();
  const int index = card.builder().add_scalar(std::move(node));
  if (sampling.period == 0) return;
  const int held = card.model().scalars[index].memory;
  const auto value = std::make_shared<SampleAndHold>(
      sampling.dof, sampling.period, held, card.builder().allocate_memory(SampleAndHold::kMemory));
  card.model().scalars[index].binding = value;
  card.builder().on_step(value);
}

void read_node_card(DeckCard& card) {
  const std::string& word = card.statement().word;
  if (word == "structural") {
    StructuralNode node;
    const int label = begin_node(
        card, Kind::structural_node, node,
        [](const Model& m, int l) { return m.find_structural(l); },
        [](const Model& m, int i) { return m.structural[i].where; });
    read_structural_node(card, label, std::move(node));
  } else if (const int type = node_type(word); type > 0) {
    read_scalar_card(card, static_cast<ScalarKind>(type - 1));
  } else if (word == "output") {
    read_nodes_output(card);
  } else {
    std::vector<std::string> accepted(kNodeWords.begin(), kNodeWords.end());
    accepted.emplace_back("output");
    fail_unknown_card(card, accepted);
  }
}

void read_driver_card(DeckCard& card) {
  Deck& deck = card.deck();
  if (card.statement().word != "file") fail_unknown_card(card, {"file"});
  card.set_defining("file driver");
  const int label = card.label("file driver label");
  card.set_defining("file driver", label);
  if (const auto found = deck.file_drivers.find(label); found != deck.file_drivers.end())
    deck.redefined(card, "file driver", label, found->second.where);
  deck.count_entity(card, Kind::file_driver, label);
  card.set_subject("file driver " + std::to_string(label));
  card.optional_name();
  FileDriverPtr driver = card.file_driver_definition(label);
  card.expect_end();
  deck.file_drivers[label] = {std::move(driver), card.head()};
}

}  // namespace mbcosim
