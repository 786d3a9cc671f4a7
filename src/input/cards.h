/// The cards of the blocks and those that may stand anywhere. Each function reads one statement;
/// errors are thrown.
#pragma once

#include "input/deck_card.h"
#include "model/node.h"
#include "model/settings.h"

namespace mbcosim {

/// Reads a card that may stand in any block; false (nothing read) when the word is none of them.
bool read_anywhere_card(DeckCard& card);
void read_data_card(DeckCard& card);
void read_initial_value_card(DeckCard& card);
/// Cards of the block `inverse dynamics`, which stands in the place of `initial value`.
void read_inverse_dynamics_card(DeckCard& card);
void read_control_card(DeckCard& card);
void read_node_card(DeckCard& card);
void read_driver_card(DeckCard& card);
void read_element_card(DeckCard& card);

/// The part in inverse dynamics of the elements that a card just read (those from number `before`
/// on): what their type has, then `inverse dynamics, ...` when it is there.
void set_inverse_role(DeckCard& card, std::size_t before);
void read_inverse_role(DeckCard& card, std::size_t before);
/// When the deck is read: nodes and elements of an inverse dynamics problem.
void finish_inverse_dynamics(Deck& deck);

/// The words that `read_initial_value_card` and `read_control_card` accept.
std::vector<std::string> initial_value_words();
std::vector<std::string> inverse_dynamics_words();
std::vector<std::string> control_words();

/// Kinds of nodes as cards name them.
void read_structural_node(DeckCard& card, int label, StructuralNode node);
void read_scalar_node(DeckCard& card, ScalarKind kind, ScalarNode node);

/// Refuses the card itself: `unknown card "mx iterations"`, with the nearest of `accepted`.
[[noreturn]] void fail_unknown_card(DeckCard& card, const std::vector<std::string>& accepted);
/// Warns that a word is an old name, or an old form, of `present`.
void warn_old_name(DeckCard& card, SourceSpan where, std::string_view present);
/// Skips the rest of a statement that is accepted and has no effect here.
void ignore_rest(DeckCard& card, const std::string& why);
/// A card that is accepted and has no effect.
inline void ignore_card(DeckCard& card) { ignore_rest(card, "this card has no effect"); }
/// `output, { yes | no | default | <bool> }`, when it is there.
void read_output_option(DeckCard& card, bool default_value, bool& output);
/// The labels of an `output` card: calls `mark(first, last)` for each range; first = last for a
/// single label.
template <class Mark>
void read_output_labels(DeckCard& card, Mark mark) {
  do {
    if (card.keyword("range")) {
      const int first = card.label("first label"), last = card.label("last label");
      if (last < first) card.fail("range: the last label is less than the first");
      mark(first, last);
    } else {
      const int label = card.label("label");
      mark(label, label);
    }
  } while (card.more());
}

/// A method of time integration, as in `method` and `dummy steps method`.
MethodSettings read_method(DeckCard& card);
void read_nonlinear_solver(DeckCard& card);
void read_legacy_newton(DeckCard& card);  ///< the old card `newton raphson`
/// The arguments of `linear solver`, checked and without effect.
void read_linear_solver(DeckCard& card);
void read_eigenanalysis(DeckCard& card);

}  // namespace mbcosim
