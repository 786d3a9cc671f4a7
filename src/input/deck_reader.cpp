#include "input/deck_reader.h"

#include <algorithm>
#include <limits>

#include "input/cards.h"
#include "input/lexer.h"
#include "input/suggest.h"
#include "model/check.h"
#include "model/inverse_problem.h"

namespace mbcosim {

namespace {

constexpr const char* kBlockNames[] = {"",      "data",    "initial value", "control data",
                                       "nodes", "drivers", "elements",      ""};

constexpr const char* kOrder =
    "the blocks stand in this order, once each: data, initial value (or inverse dynamics), control "
    "data, nodes, drivers, elements";

/// Is there anything but blanks and comments in `text`, other than a `parallel` block?
bool has_content(std::string_view text) {
  std::size_t i = 0;
  while (i < text.size()) {
    if (is_blank(text[i])) {
      ++i;
    } else if (text[i] == '#') {
      i = std::min(text.find('\n', i), text.size());
    } else if (text.substr(i, 2) == "/*") {
      const std::size_t end = text.find("*/", i + 2);
      if (end == std::string_view::npos) return true;
      i = end + 2;
    } else {
      return !normalized(text.substr(i, 40)).starts_with("begin:parallel;");
    }
  }
  return false;
}

/// By label, as .drv lists them.
void sort_drives(Model& model) {
  std::sort(model.drives.begin(), model.drives.end(),
            [](const NamedDrive& a, const NamedDrive& b) { return a.label < b.label; });
  for (std::size_t k = 0; k < model.drives.size(); ++k)
    model.drive_index[model.drives[k].label] = static_cast<int>(k);
}

}  // namespace

void DeckReader::record(Diagnostic diagnostic, const DeckCard& card) {
  card.add_remedy(diagnostic);
  if (block_ >= Block::nodes && diagnostic.code == "unknown-word" && card.defined_kind().empty())
    skipped_ = true;
  deck_.reading.report(std::move(diagnostic));
  if (!card.defined_kind().empty()) deck_.damage(card.defined_kind(), card.defined_label());
}

void DeckReader::read() {
  Reading& reading = deck_.reading;
  while (!done_ && !reading.full() && !reading.exited) {
    const std::optional<Statement> statement = statements_.next();
    if (!statement) break;
    reading.set_trail(statement->trail);
    read_statement(*statement);
    if (done_) warn_about_rest(*statement);
  }
  reading.set_trail(-1);
  if (!reading.full() && !reading.exited) finish();
}

void DeckReader::read_statement(const Statement& statement) {
  Reading& reading = deck_.reading;
  DeckCard card(deck_, statement);
  try {
    dispatch(card);
  } catch (const DeckError& error) {
    record(error.diagnostic, card);
  } catch (const InternalError& error) {
    record(reading.diagnostic(Severity::error, "internal", card.last(), error.what()), card);
  } catch (const std::exception& error) {
    record(reading.diagnostic(
               Severity::error, "error", card.last(),
               card.subject().empty() ? error.what() : card.subject() + ": " + error.what()),
           card);
  }
  reading.set_damaged(false);
  reading.currents.clear();
}

void DeckReader::dispatch(DeckCard& card) {
  const std::string& word = card.statement().word;
  if (word == "begin") return begin(card);
  if (word == "end") return end(card);
  if (block_ == Block::foreign) return;
  card.set_form("statement", word);
  if (read_anywhere_card(card)) return;
  card.set_form(group_of_cards(), word);
  switch (block_) {
    case Block::data:
      return read_data_card(card);
    case Block::initial_value:
      return is_inverse() ? read_inverse_dynamics_card(card) : read_initial_value_card(card);
    case Block::control_data:
      return read_control_card(card);
    case Block::nodes:
      return read_node_card(card);
    case Block::drivers:
      return read_driver_card(card);
    case Block::elements:
      return read_element_card(card);
    default:
      break;
  }
  fail_unknown_card(
      card, {"begin", "set", "include", "remark", "reference", "scalar function", "drive caller",
             "constitutive law", "hydraulic fluid", "template drive caller", "print symbol table"});
}

// ------------------------------------------------------------------------------------------------
// blocks

/// The block of the solution has the name of the problem.
std::string DeckReader::block_name(int block) const {
  return block == static_cast<int>(Block::initial_value) && is_inverse() ? "inverse dynamics"
                                                                         : kBlockNames[block];
}
bool DeckReader::is_inverse() const { return deck_.inverse_dynamics; }

std::string_view DeckReader::group_of_cards() const {
  switch (block_) {
    case Block::initial_value:
      return is_inverse() ? "inverse dynamics card" : "initial value card";
    case Block::control_data:
      return "control card";
    case Block::nodes:
      return "node";
    case Block::elements:
      return "element";
    default:
      return "";
  }
}

void DeckReader::open(Block block, const std::string& name, SourceSpan where) {
  block_ = latest_ = block;
  name_ = name;
  begun_ = where;
}

void DeckReader::close() {
  if (block_ == Block::initial_value)
    deck_.reading.start_run_variables(deck_.builder.model().initial_value.initial_time);
  if (block_ == Block::elements) done_ = true;
  block_ = Block::none;
}

/// Blocks that must stand before `block` and were not met.
void DeckReader::check_order(DeckCard& card, Block block) {
  if (block <= latest_) {
    card.fail(
        block == latest_
            ? "block \"" + std::string(kBlockNames[static_cast<int>(block)]) + "\" occurs twice"
            : "block \"" + std::string(kBlockNames[static_cast<int>(block)]) +
                  "\" must stand before block \"" + kBlockNames[static_cast<int>(latest_)] + "\"",
        kOrder);
  }
  const Block last_required = std::min(block, Block::nodes);
  for (int b = static_cast<int>(latest_) + 1; b < static_cast<int>(last_required); ++b) {
    deck_.reading.report(deck_.reading.diagnostic(Severity::error, "block-order", card.last(),
                                                  "block \"" + block_name(b) + "\" expected",
                                                  kOrder));
    return;
  }
}

void DeckReader::begin(DeckCard& card) {
  Reading& reading = deck_.reading;
  if (!card.more()) card.fail("name of the block missing", "", "missing-argument");
  const SourceSpan where = card.next();
  const std::string name = card.word("block");
  if (block_ != Block::none) {
    reading.report(reading.diagnostic(
        Severity::error, "block", card.head(),
        "block \"" + name_ + "\" begun at line " + std::to_string(begun_.line) + " is not closed",
        "close the block: `end: " + name_ + ";`"));
    close();
    done_ = false;
  }
  const std::string word = name == "multistep" ? "initialvalue" : name;
  if (name == "multistep") warn_old_name(card, card.last(), "initial value");
  Block block = Block::foreign;
  for (int b = 1; b <= static_cast<int>(Block::elements); ++b)
    if (normalized(block_name(b)) == word) block = static_cast<Block>(b);
  if (block == Block::foreign) {
    const Block latest = latest_;
    open(block, name, card.head());
    latest_ = latest;
    skipped_ = true;
    for (int k = 0; k < kKinds; ++k) deck_.damage(kind_names(static_cast<Kind>(k)).singular, -1);
    card.fail_at(where, "unknown block \"" + name + "\"",
                 suggested_word(name, {"data", block_name(static_cast<int>(Block::initial_value)),
                                       "control data", "nodes", "drivers", "elements"}),
                 "unknown-word");
  }
  const std::string written = block_name(static_cast<int>(block));
  const Block latest = latest_;
  try {
    check_order(card, block);
  } catch (const DeckError&) {
    open(block, written, card.head());
    latest_ = std::max(latest, block);
    throw;
  }
  open(block, written, card.head());
  if (block == Block::initial_value && is_inverse()) part<InverseProblem>(deck_.builder);
  if (card.more())
    card.fail_at(card.next(), "unexpected argument after \"" + written + "\"", "",
                 "unexpected-argument");
}

void DeckReader::end(DeckCard& card) {
  if (!card.more()) card.fail("name of the block missing", "", "missing-argument");
  const std::string name = card.word("block");
  if (block_ == Block::none)
    card.fail("\"end: " + name + "\" without its \"begin\"",
              "remove the card, or write `begin: " + name + ";` before the block");
  const std::string open_name = name_, line = std::to_string(begun_.line);
  const bool same = normalized(name_) == name || block_ == Block::foreign ||
                    (block_ == Block::initial_value && name == "multistep");
  const SourceSpan where = card.head();
  close();
  if (!same) {
    done_ = false;
    card.fail_at(
        where,
        "block \"" + open_name + "\" (begun at line " + line + ") closed by \"end: " + name + "\"",
        "write `end: " + open_name + ";`");
  }
  if (card.more())
    card.fail_at(card.next(), "unexpected argument after \"" + open_name + "\"", "",
                 "unexpected-argument");
}

void DeckReader::warn_about_rest(const Statement& last) {
  Reading& reading = deck_.reading;
  if (last.file != 0) return;
  const std::string& text = reading.file(0).text;
  const std::size_t after = std::min(text.find(';', last.offset + last.text.size()), text.size());
  if (after < text.size() && has_content(std::string_view(text).substr(after + 1)))
    reading.warn(reading.span(0, last.offset, last.text.size()),
                 "text after the last block is ignored");
}

// ------------------------------------------------------------------------------------------------
// end of the deck

void DeckReader::check_counts() {
  Reading& reading = deck_.reading;
  std::string missing;
  SourceSpan where = begun_;
  for (int k = 0; k < kKinds; ++k) {
    const Count& count = deck_.counts[k];
    const int lack = count.declared ? *count.declared - count.found : 0;
    const KindNames& names = kind_names(static_cast<Kind>(k));
    if (lack <= 0 || deck_.any_was_refused(names.singular)) continue;
    if (missing.empty() && count.where.file >= 0) where = count.where;
    missing += (missing.empty() ? "" : ", ") + std::to_string(lack) + " " +
               (lack == 1 ? names.singular : names.plural);
  }
  if (!missing.empty())
    reading.report(reading.diagnostic(Severity::error, "missing-entities", where,
                                      "end of the deck: " + missing + " missing",
                                      "correct the counts of the control data or add what lacks"));
}

void DeckReader::check_parameters() {
  Reading& reading = deck_.reading;
  const std::vector<ScalarNode>& scalars = deck_.builder.model().scalars;
  for (std::size_t i = 0; i < scalars.size(); ++i)
    if (scalars[i].bound_to_element && !deck_.bound_parameters.count(static_cast<int>(i)))
      reading.report(reading.diagnostic(
          Severity::error, "unbound-parameter", scalars[i].where,
          "parameter node " + std::to_string(scalars[i].label) + " is bound to no element",
          "add a \"bind\" card to the elements"));
}

/// What the cards of the initial value block must agree on, in whatever order they stand.
void DeckReader::check_initial_value() {
  InitialValueSettings& s = deck_.builder.model().initial_value;
  const auto refuse = [&](SourceSpan where, const std::string& message) {
    deck_.reading.report(deck_.reading.diagnostic(Severity::error, "initial-value", where, message,
                                                  "correct one of the cards of the block"));
  };
  if (s.strategy == StepStrategy::factor) {
    if (s.max_iterations_factor == 0) s.max_iterations_factor = s.max_iterations;
    if (s.max_iterations_factor <= s.min_iterations)
      refuse(deck_.strategy_where, "strategy factor: max iterations (" +
                                       std::to_string(s.max_iterations_factor) +
                                       ") must be greater than min iterations (" +
                                       std::to_string(s.min_iterations) + ")");
  }
  if (s.strategy != StepStrategy::change) return;
  double largest = std::numeric_limits<double>::infinity();
  try {
    if (s.max_time_step) largest = s.max_time_step->value(deck_.builder.input_context());
  } catch (const EvaluationError&) {
    return;  // known only while the model runs
  }
  if (s.min_time_step > largest)
    refuse(deck_.strategy_where, "min time step is greater than max time step");
  else if (s.time_step < s.min_time_step)
    refuse(deck_.strategy_where, "time step is less than min time step");
  else if (s.time_step > largest)
    refuse(deck_.strategy_where, "time step is greater than max time step");
}

void DeckReader::finish() {
  Reading& reading = deck_.reading;
  if (block_ != Block::none) {
    reading.report(reading.diagnostic(
        Severity::error, "end-of-file", begun_,
        "end of file in block \"" + name_ + "\" begun at line " + std::to_string(begun_.line),
        "close the block: `end: " + name_ + ";`"));
    return;
  }
  if (latest_ == Block::none) return;  // a deck without blocks: a calculator
  if (latest_ < Block::control_data) {
    reading.report(reading.diagnostic(Severity::error, "block-order", begun_,
                                      std::string("block \"") +
                                          kBlockNames[static_cast<int>(latest_) + 1] +
                                          "\" expected, end of file found",
                                      kOrder));
    return;
  }
  if (!skipped_) check_counts();
  check_parameters();
  check_initial_value();
  Model& model = deck_.builder.model();
  if (is_inverse()) finish_inverse_dynamics(deck_);
  const InitialValueSettings& iv = model.initial_value;
  if (iv.final_time < iv.initial_time && deck_.final_time_where.file >= 0)
    reading.warn(deck_.final_time_where,
                 "final time is before the initial time: there is nothing to integrate",
                 "give a final time after the initial one, or `forever`");
  if (model.control.output_drives)
    for (const int d : deck_.drives_without_output) model.drives[d].output_value = true;
  sort_drives(model);
}

}  // namespace mbcosim
