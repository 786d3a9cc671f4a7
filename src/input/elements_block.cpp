/// Cards of the `elements` block: any element by its head, `driven`, `bind`, `output`.
#include "input/cards.h"
#include "input/deck.h"
#include "input/lexer.h"
#include "input/model_functions.h"
#include "input/suggest.h"
#include "model/family.h"
#include "model/nested_evaluation.h"

namespace mbcosim {

namespace {

/// What `driven` gives to its inner element.
struct Driven {
  DrivePtr drive;
  std::vector<Hint> hints;
  int label = -1;
};

[[noreturn]] void fail_unknown_head(DeckCard& card) {
  const Registry& registry = card.registry();
  std::vector<std::string> accepted = {"driven", "bind", "output"};
  for (const auto& [word, head] : registry.heads) accepted.emplace_back(head.word);
  card.refuse_unsupported(card.head(), "elements", card.statement().word);
  fail_unknown_card(card, accepted);
}

/// The reader of a head with types: consumes the type word.
const Registry::ElementReader& typed_reader(DeckCard& card, const Registry::Head& head,
                                            ElementInfo& info) {
  const std::string& word = card.statement().word;
  const std::string what = std::string(head.word) + " type";
  if (!card.more()) card.fail(what + " missing", "", "missing-argument");
  const SourceSpan where = card.next();
  const std::string type = card.peek_word();
  if (const auto* const found = head.types.find(type)) {
    card.skip();
    info.type = found->word;
    card.set_type_form(word, found->key);
    return found->value;
  }
  if (type.empty()) card.fail_expected(what + " expected");
  card.refuse_unsupported(where, word, type);
  std::vector<std::string> accepted;
  for (const auto& t : head.types) accepted.emplace_back(t.word);
  card.fail_at(where, "unknown " + what + " \"" + type + "\"", suggested_word(type, accepted),
               "unknown-word");
}

/// Label, duplicates, count and name: what all elements begin with.
void read_element_head(DeckCard& card, Family family, bool has_label, const Driven* driven,
                       ElementInfo& info) {
  const char* name = family_name(family);
  info.family = family;
  info.where = card.head();
  info.output = card.deck().output.family[static_cast<int>(family)];
  card.set_defining(name);
  card.set_subject(name);
  if (has_label) {
    info.label = card.label("label");
    card.set_defining(name, info.label);
    if (driven && info.label != driven->label) {
      card.set_subject("");
      card.fail("inner label " + std::to_string(info.label) + " differs from driven label " +
                std::to_string(driven->label));
    }
    // An `automatic structural` exists with its node; cards give it initial values.
    if (const ElementRef before = card.model().find_element(family, info.label);
        before.set && family != Family::automatic_structural) {
      card.set_subject("");
      card.deck().redefined(card, name, info.label, before.set->info(before.index).where);
    }
    card.set_subject(std::string(name) + " " + std::to_string(info.label));
  }
  if (driven) info.driven = driven->drive;
}

/// The trailing `output` option applies to what the reader added (after `before` elements).
void read_trailing_output(DeckCard& card, Family family, std::size_t before) {
  const Model& model = card.model();
  if (card.peek_word() != "output") return;
  const bool fallback = card.deck().output.family[static_cast<int>(family)];
  bool output = fallback;
  read_output_option(card, fallback, output);
  for (std::size_t i = before; i < model.elements.size(); ++i)
    card.builder().info(model.elements[i]).output = output;
}

/// "offset{2}", however it is spaced.
std::string without_blanks(const Hint& hint) {
  std::string text = hint.name + "{";
  for (const char c : hint.arguments.text)
    if (!is_blank(c)) text += c;
  return text + "}";
}

/// Hints that the element's reader did not ask for: they move parts of the element. `others`: which
/// hints that reader takes, for the remedy.
void apply_to_parts(DeckCard& card, const ElementRef& element, const std::vector<Hint>& hints,
                    const std::string& others) {
  for (const Hint& h : hints)
    if (!h.used && !card.builder().add_hint(element, without_blanks(h)))
      card.warn_at(
          h.where, "hint \"" + h.name + "\" is not applied: the element starts as its card says",
          "applied are offset{1 or 2, 0 for the place of a pin} and hinge{1 or 2} of joints "
          "that have them, " +
              others);
}
constexpr const char* kReadHints =
    "drive{} (distance), drive3{} (drive hinge, drive displacement), position-drive3{} and "
    "orientation-drive3{} (total joint)";
constexpr const char* kNoReadHints =
    "others when the element is written inside the driven card instead of `existing`";

/// Joints of what the reader added (after `before` elements) between a node and itself.
void refuse_self_joints(DeckCard& card, Family family, std::size_t before) {
  const Model& model = card.model();
  if (family != Family::joint) return;
  for (std::size_t i = before; i < model.elements.size(); ++i) {
    const std::vector<int> nodes = model.elements[i].set->nodes(model.elements[i].index);
    if (nodes.size() != 2 || nodes[0] != nodes[1]) continue;
    card.fail("both nodes are structural node " + std::to_string(model.structural[nodes[0]].label),
              "a joint connects two different nodes; to fix a node in space use a pin or `clamp`");
  }
}

void read_element(DeckCard& card, Driven* driven = nullptr) {
  const Registry& registry = card.registry();
  const std::string word = card.statement().word;
  const FamilyFacts* const family = family_by_head(word);
  const auto head = registry.heads.find(word);
  if (head == registry.heads.end() && !family) fail_unknown_head(card);
  const Family f = head != registry.heads.end() ? head->second.family : family->family;
  const bool has_label = head != registry.heads.end() ? head->second.has_label : family->has_label;
  ElementInfo info;
  read_element_head(card, f, has_label, driven, info);
  const bool counted_later = f == Family::inertia;  // counts only with `output, always`
  const std::string subject = card.subject();
  if (!counted_later) card.deck().count_entity(card, kind_of(f), info.label);
  card.set_subject(subject);
  if (head == registry.heads.end()) fail_unknown_head(card);
  info.name = card.optional_name();
  const Registry::ElementReader& reader =
      head->second.types.empty() ? head->second.reader : typed_reader(card, head->second, info);
  if (info.type.empty()) info.type = head->second.word;
  if (!head->second.types.empty()) card.set_subject(subject + " (" + info.type + ")", info.type);
  const std::size_t before = card.model().elements.size();
  std::vector<HintSample> samples;
  if (driven) card.set_hints(&driven->hints, &samples);
  reader(card, info);
  refuse_self_joints(card, f, before);
  if (driven && card.model().elements.size() > before) {
    const ElementRef element = card.model().elements[before];
    card.builder().info(element).hints = std::move(samples);
    apply_to_parts(card, element, driven->hints, kReadHints);
  }
  set_inverse_role(card, before);
  read_inverse_role(card, before);
  read_trailing_output(card, f, before);
  read_inverse_role(card, before);
  card.expect_end();
  if (counted_later && card.model().elements.size() > before)
    card.deck().count_entity(card, kind_of(f), info.label);
}

// ------------------------------------------------------------------------------------------------
// driven

void drive_existing(DeckCard& card, const Driven& driven) {
  const Family family = card.element_family("element type");
  const int label = card.label("label");
  if (label != driven.label)
    card.fail("inner label " + std::to_string(label) + " differs from driven label " +
              std::to_string(driven.label));
  const ElementRef e = card.model().find_element(family, label);
  if (!e.set) card.fail_undefined(card.last(), family_name(family), label);
  ElementInfo& info = card.builder().info(e);
  if (info.driven)
    card.fail(std::string(family_name(family)) + " " + std::to_string(label) +
              " is driven already");
  // What the element's own card or an `output` card said before does not count.
  const bool usual = card.deck().output.family[static_cast<int>(family)];
  info.output = usual;
  read_output_option(card, usual, info.output);
  card.expect_end();
  info.driven = driven.drive;
  card.builder().register_driven(info);
  apply_to_parts(card, e, driven.hints, kNoReadHints);
}

void read_driven(DeckCard& card) {
  Driven driven;
  card.set_subject("driven");
  driven.label = card.label("label");
  card.set_subject("driven " + std::to_string(driven.label));
  driven.drive = card.drive();
  while (card.keyword("hint")) {
    do driven.hints.push_back(card.hint());
    while (card.at_string());
  }
  if (!card.more())
    card.fail("inner element missing", "e.g. driven: 1, <drive>, joint: 1, clamp, ...",
              "missing-argument");
  DeckCard inner(card.deck(), card.rest_as_statement());
  inner.set_form("element", inner.statement().word);
  if (inner.statement().word == "existing") {
    drive_existing(inner, driven);
    return;
  }
  if (const FamilyFacts* const family = family_by_head(inner.statement().word))
    card.set_defining(family->name, driven.label);
  try {
    read_element(inner, &driven);
  } catch (DeckError& error) {
    inner.add_remedy(error.diagnostic);
    throw;
  }
}

// ------------------------------------------------------------------------------------------------
// bind

/// Strain of a gage on a beam section: ε₁ + z κ₂ − y κ₃.
class BeamGage final : public Drive {
 public:
  BeamGage(ElementRef beam, const int (&data)[3], double y, double z) : beam_(beam), y_(y), z_(z) {
    std::copy(data, data + 3, data_);
  }
  double value(const EvalContext& context, double) const override {
    const NestedEvaluation nested;
    const auto datum = [&](int k) {
      return beam_.set->private_value(context, beam_.index, data_[k]);
    };
    return datum(0) + z_ * datum(1) - y_ * datum(2);
  }

 private:
  ElementRef beam_;
  int data_[3];  ///< of ε₁, κ₂, κ₃
  double y_, z_;
};

std::string element_name(DeckCard& card, ElementRef e) { return card.model().element_text(e); }

DrivePtr gage_drive(DeckCard& card, ElementRef e, const ScalarNode& node,
                    const std::string& prefix) {
  int data[3];
  const char* names[] = {"ex", "ky", "kz"};
  for (int k = 0; k < 3; ++k) {
    data[k] = e.set->private_datum(e.index, prefix + names[k]);
    if (data[k] < 0)
      card.fail(element_name(card, e) + " has no private datum \"" + prefix + names[k] + "\"");
  }
  return std::make_shared<BeamGage>(e, data, node.gage_y, node.gage_z);
}

DrivePtr read_datum(DeckCard& card, ElementRef e, const ScalarNode& node) {
  if (card.one_of({"string", "name"}) >= 0) {
    const std::string name = card.quoted("private datum");
    if (node.gage) return gage_drive(card, e, node, name);
    const int datum = e.set->private_datum(e.index, name);
    if (datum < 0)
      card.fail(element_name(card, e) + " has no private datum \"" + name + "\"",
                suggestion(name, e.set->data_names(e.index)));
    return element_datum(e, datum);
  }
  card.keyword("index");
  const int n = card.integer("index of the private datum");
  if (node.gage)
    return gage_drive(card, e, node,
                      e.set->private_datum(e.index, "ex") >= 0 ? ""
                      : n == 1                                 ? "pI."
                                                               : "pII.");
  const std::vector<std::string> names = e.set->data_names(e.index);
  if (n < 1 || n > static_cast<int>(names.size()))
    card.fail(element_name(card, e) + " has " + std::to_string(names.size()) +
              " private data; index " + std::to_string(n));
  return element_datum(e, e.set->private_datum(e.index, names[n - 1]));
}

void read_bind(DeckCard& card) {
  card.set_subject("bind");
  if (card.peek_word() == "airproperties")
    card.fail_unsupported(card.next(), "air properties", "aerodynamics");
  const int label = card.label("element label");
  const Family family = card.element_family("element type");
  const ElementRef e = card.model().find_element(family, label);
  const SourceSpan where = card.last();
  const int index = card.scalar_node(ScalarKind::parameter);
  ScalarNode& node = card.model().scalars[index];
  if (!e.set) {
    card.deck().bound_parameters.insert(index);
    card.fail_undefined(where, family_name(family), label);
  }
  if (!node.bound_to_element)
    card.fail("parameter node " + std::to_string(node.label) + " is not of kind \"element\"",
              "declare it as: parameter: " + std::to_string(node.label) + ", element");
  if (!card.deck().bound_parameters.insert(index).second)
    card.fail("parameter node " + std::to_string(node.label) + " is bound already");
  DrivePtr value = read_datum(card, e, node);
  card.expect_end();
  node.binding = std::move(value);
}

// ------------------------------------------------------------------------------------------------
// output

void read_elements_output(DeckCard& card) {
  const Family family = card.element_family("element type");
  const Model& model = card.model();
  read_output_labels(card, [&](int first, int last) {
    if (first == last) {
      const ElementRef e = model.find_element(family, first);
      if (e.set)
        card.builder().info(e).output = true;
      else if (!card.deck().was_refused(family_name(family), first))
        card.warn(undefined_text(family_name(family), first));
      return;
    }
    for (const ElementRef& e : model.elements) {
      ElementInfo& info = card.builder().info(e);
      if (info.family == family && info.label >= first && info.label <= last) info.output = true;
    }
  });
  card.expect_end();
}

}  // namespace

void read_element_card(DeckCard& card) {
  const std::string& word = card.statement().word;
  if (word == "driven")
    read_driven(card);
  else if (word == "bind")
    read_bind(card);
  else if (word == "output")
    read_elements_output(card);
  else
    read_element(card);
}

}  // namespace mbcosim
