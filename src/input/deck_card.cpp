/// Words, numbers and errors of a card.
#include "input/deck_card.h"

#include <cmath>
#include <utility>

#include "input/deck.h"
#include "input/grammar/grammar.h"
#include "input/lexer.h"
#include "input/refusals.h"
#include "input/suggest.h"

namespace mbcosim {

namespace {

/// Is the normalized `found` the keyword that the source writes as `word`?
bool same_word(std::string_view found, std::string_view word) {
  std::size_t i = 0;
  for (const char c : word) {
    if (c == ' ') continue;
    if (i == found.size() || found[i] != std::tolower(static_cast<unsigned char>(c))) return false;
    ++i;
  }
  return i == found.size();
}

std::string text_of(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", x);
  return text;
}

}  // namespace

DeckCard::DeckCard(Deck& deck, const Statement& statement)
    : deck_(deck), statement_(statement), cursor_(deck.reading, statement_) {}

SourceSpan DeckCard::head() const {
  std::size_t length = statement_.text.find_first_of(":;,");
  if (length == std::string_view::npos) length = statement_.text.size();
  while (length > 1 && is_blank(statement_.text[length - 1])) --length;
  return deck_.reading.span(statement_.file, statement_.offset, length);
}

void DeckCard::set_subject(std::string subject, std::string type) {
  subject_ = std::move(subject);
  type_ = std::move(type);
}

void DeckCard::set_defining(std::string kind, int label) {
  defined_kind_ = std::move(kind);
  defined_label_ = label;
}

std::string_view DeckCard::next_text() {
  if (!cursor_.more()) return {};
  const SourceSpan where = next();
  const std::size_t start = deck_.reading.offset_of(where) - statement_.offset;
  return statement_.text.substr(std::min(start, statement_.text.size()), where.length);
}

void DeckCard::skip() {
  cursor_.skip();
  consumed();
}

void DeckCard::accept_word() {
  const std::string_view text = next_text();
  const Symbol* const symbol = std::as_const(deck_.reading.symbols).find(text);
  if (symbol && symbol->role == SymbolRole::plain && !symbol->predefined)
    warn_at(next(),
            "\"" + symbol->name + "\" is a keyword here; the variable of this name is hidden",
            "write (" + symbol->name + ") for the variable");
  skip();
}

void DeckCard::consumed() { has_peeked_ = false; }

// ----------------------------------------------------------------------------------------------
// words

std::string DeckCard::peek_word() {
  if (!has_peeked_) {
    peeked_ = cursor_.more() ? cursor_.peek_word() : std::string();
    has_peeked_ = true;
  }
  return peeked_;
}

bool DeckCard::keyword(std::string_view word) {
  if (!has_peeked_) peek_word();
  if (peeked_.empty() || !same_word(peeked_, word)) return false;
  accept_word();
  return true;
}

int DeckCard::one_of(std::initializer_list<std::string_view> words) {
  if (!has_peeked_) peek_word();
  if (peeked_.empty()) return -1;
  int index = 0;
  for (const std::string_view word : words) {
    if (same_word(peeked_, word)) {
      accept_word();
      return index;
    }
    ++index;
  }
  return -1;
}

int DeckCard::required(std::string_view what, std::initializer_list<std::string_view> words) {
  const int k = one_of(words);
  if (k >= 0) return k;
  const std::vector<std::string> accepted(words.begin(), words.end());
  std::string list;
  for (const std::string& w : accepted) list += (list.empty() ? "" : ", ") + w;
  const std::string expected = std::string(what) + " expected (" + list + ")";
  if (!more()) fail(expected + ", end of the card found", "", "wrong-argument");
  const std::string found = peek_word();
  if (found.empty()) fail_expected(expected);
  fail_expected(expected + ", \"" + found + "\" found", suggestion(found, accepted));
}

std::string DeckCard::word(std::string_view what) {
  need_argument(what);
  std::string w = cursor_.word(what);
  consumed();
  return w;
}

bool DeckCard::more() { return cursor_.more(); }
bool DeckCard::at_string() { return cursor_.more() && cursor_.at_string(); }

// ----------------------------------------------------------------------------------------------
// numbers

DeckCard::Nesting::Nesting(DeckCard& card) : card_(card) {
  card_.weight_.depth = std::max(card_.weight_.depth, ++card_.nesting_);
  ++card_.weight_.objects;
  if (card_.nesting_ <= card_.deck_.reading.limits.expression_depth) return;
  --card_.nesting_;
  card_.deck_.reading.fail_limit(card_.last(), "expression-depth",
                                 "drives, laws or functions are nested deeper than " +
                                     std::to_string(card_.deck_.reading.limits.expression_depth) +
                                     " levels");
}

void DeckCard::refer(const std::string& name, const Weight& weight) {
  constexpr int kDeepest = 1000;  // evaluation recurses along the chain
  constexpr int kMost = 100000;
  weight_.depth = std::max(weight_.depth, nesting_ + weight.depth);
  weight_.objects += weight.objects;
  if (weight_.depth > kDeepest) fail("the chain of references behind " + name + " is too long");
  if (weight_.objects > kMost)
    fail("with " + name + " more than " + std::to_string(kMost) +
             " drives, laws, functions or nodes would be evaluated for one value",
         "each counts as often as it is referred to");
}

void DeckCard::need_numbers(std::string_view what, std::int64_t count) {
  if (count > static_cast<std::int64_t>(statement_.text.size()))
    fail(std::string(what) + ": " + std::to_string(count) + " numbers expected; the card has fewer",
         "", "wrong-argument");
}

void DeckCard::need_argument(std::string_view what) {
  if (!cursor_.more()) fail(std::string(what) + " missing", "", "missing-argument");
}

void DeckCard::refuse_word(std::string_view what) {
  const std::string w = peek_word();
  if (w.empty()) return;
  static const std::set<std::string, std::less<>> kWords = {
      "null",   "eye",       "default",  "reference",       "position", "orientation", "hinge",
      "diag",   "matr",      "sym",      "output",          "scale",    "name",        "node",
      "same",   "fromnodes", "euler",    "euler123",        "euler313", "euler321",    "const",
      "single", "array",     "velocity", "angularvelocity", "yes",      "no",          "guess",
      "forever"};
  if (!kWords.count(w)) return;
  if (deck_.reading.symbols.find(next_text())) return;
  fail_expected(std::string(what) + " expected, keyword \"" + w + "\" found");
}

Value DeckCard::value(std::string_view what) {
  need_argument(what);
  refuse_word(what);
  if (cursor_.at_string()) fail_expected(std::string(what) + ": number expected, string found");
  Value v = cursor_.expression(what);
  consumed();
  return v;
}

double DeckCard::real(std::string_view what, double fallback) {
  need_argument(what);
  if (cursor_.at_empty()) {
    skip();
    return fallback;
  }
  const Value v = value(what);
  if (const double* x = std::get_if<double>(&v)) return *x;
  if (const std::int32_t* i = std::get_if<std::int32_t>(&v)) return *i;
  if (const bool* b = std::get_if<bool>(&v)) return *b ? 1 : 0;
  fail(std::string(what) + ": number expected, string found", "", "wrong-argument");
}

int DeckCard::integer(std::string_view what, int fallback) {
  const double x = real(what, fallback);
  if (!(x > -2147483649.0 && x < 2147483648.0))
    fail(std::string(what) + ": integer out of range: " + text_of(x));
  const double whole = std::trunc(x);
  if (whole != x) warn(std::string(what) + " " + text_of(x) + " truncated to " + text_of(whole));
  return static_cast<int>(whole);
}

int DeckCard::label(std::string_view what) {
  const double x = real(what);
  if (!(x >= 0 && x < 2147483648.0))
    fail(std::string(what) + " must be between 0 and 2147483647, got " + text_of(x));
  const double whole = std::trunc(x);
  if (whole != x) warn(std::string(what) + " " + text_of(x) + " truncated to " + text_of(whole));
  return static_cast<int>(whole);
}

int DeckCard::count(std::string_view what) {
  const int n = integer(what);
  if (n < 0) fail("count must not be negative, got " + std::to_string(n), "write how many follow");
  return n;
}

double DeckCard::real_above(std::string_view what, double bound, bool inclusive) {
  const double x = real(what);
  if (!(inclusive ? x >= bound : x > bound))
    fail(std::string(what) + " must be " + (inclusive ? "at least " : "greater than ") +
         text_of(bound) + ", got " + text_of(x));
  return x;
}

double DeckCard::equation_scale() {
  const double s = real("scale", 1);
  if (!(s > 0))
    fail("scale must be greater than 0, got " + text_of(s),
         "residuals are multiplied by it before they are compared with the tolerance: write 1. for "
         "none");
  return s;
}

int DeckCard::integer_at_least(std::string_view what, int least) {
  const int n = integer(what);
  if (n < least)
    fail(std::string(what) + " must be at least " + std::to_string(least) + ", got " +
         std::to_string(n));
  return n;
}

bool DeckCard::yes_no(std::string_view what) {
  switch (one_of({"yes", "no", "true", "false"})) {
    case 0:
    case 2:
      return true;
    case 1:
    case 3:
      return false;
    default:
      return real(std::string(what) + " (yes, no or a number)") != 0;
  }
}

std::string DeckCard::quoted(std::string_view what) {
  need_argument(what);
  std::string text = cursor_.quoted(what);
  consumed();
  return text;
}

std::string DeckCard::file_contents(std::string_view what, std::string* name) {
  const std::string written = quoted(what);
  if (name) *name = written;
  Result<std::string> text = deck_.reading.read_data(written, statement_.file);
  if (!text) deck_.reading.fail_read(last(), text.error(), statement_.file);
  deck_.data_files.add(written);
  deck_.data_files.add(*text);
  return std::move(*text);
}

BeamOutput DeckCard::default_beam_output() const { return deck_.beam_output; }

std::string DeckCard::optional_name() { return keyword("name") ? quoted("name") : std::string(); }

// ----------------------------------------------------------------------------------------------
// errors and context

void DeckCard::fail_at(SourceSpan where, const std::string& message, const std::string& hint,
                       const char* code) {
  std::string text = message;
  if (!type_.empty() && text.starts_with(type_ + ": ")) text.erase(0, type_.size() + 2);
  if (!subject_.empty()) text = subject_ + ": " + text;
  deck_.reading.fail(where, std::move(text), hint, code);
}

void DeckCard::fail_undefined(SourceSpan where, const std::string& kind, int label,
                              const std::string& hint) {
  if (deck_.was_refused(kind, label)) deck_.reading.set_damaged(true);
  fail_at(where, undefined_text(kind, label),
          hint.empty() ? "correct the label, or define the " + kind + " before this card" : hint,
          "undefined");
}

void DeckCard::fail_unsupported(SourceSpan where, const std::string& word,
                                const std::string& what) {
  deck_.reading.fail(where,
                     (subject_.empty() ? "" : subject_ + ": ") + "\"" + word + "\" (" + what +
                         ") is not supported yet",
                     "", "not-supported");
}

void DeckCard::refuse_unsupported(SourceSpan where, const std::string& context,
                                  const std::string& word) {
  refuse_for_good(where, context, word);
  const auto group = registry().not_supported.find(context);
  if (group == registry().not_supported.end()) return;
  if (const auto* const found = group->second.find(word))
    fail_unsupported(where, std::string(found->word), std::string(found->value));
}

void DeckCard::refuse_for_good(SourceSpan where, const std::string& context,
                               const std::string& word) {
  const auto group = refusals().find(context);
  if (group == refusals().end()) return;
  const auto entry = group->second.find(word);
  if (entry == group->second.end()) return;
  const Refusal& refusal = entry->second;
  deck_.reading.fail(where,
                     (subject_.empty() ? "" : subject_ + ": ") + "\"" + refusal.word +
                         "\" is not served: " + refusal.reason,
                     refusal.remedy, "not-supported");
}

void DeckCard::warn_at(SourceSpan where, const std::string& message, const std::string& hint) {
  deck_.reading.warn(where, subject_.empty() ? message : subject_ + ": " + message, hint);
}

void DeckCard::warn(const std::string& message, const std::string& hint) {
  warn_at(last(), message, hint);
}

void DeckCard::note(const std::string& message) {
  deck_.reading.report(
      deck_.reading.diagnostic(Severity::note, "note", head(), card_name() + ": " + message));
}

std::string DeckCard::card_name() const {
  std::string name;
  for (const char c : statement_.text.substr(0, statement_.text.find_first_of(":;,"))) {
    if (!is_blank(c))
      name += c;
    else if (!name.empty() && name.back() != ' ')
      name += ' ';
  }
  while (!name.empty() && name.back() == ' ') name.pop_back();
  return name;
}

void DeckCard::add_remedy(Diagnostic& d) const {
  if (form_.wider_group.empty() || find_grammar(form_.group, form_.word))
    add_form(d, form_.group, form_.word);
  else
    add_form(d, form_.wider_group, form_.wider_word);
}

void DeckCard::expect_end() {
  if (!more()) return;
  if (subject_.empty()) subject_ = card_name();
  const SourceSpan where = next();
  const std::string_view text = next_text().substr(0, 40);
  const std::string w = peek_word();
  if (w == "scale") fail_at(where, "\"scale\" must precede \"output\"");
  fail_at(where, "unexpected argument \"" + std::string(text) + "\"", "", "unexpected-argument");
}

void DeckCard::set_current(const std::string& name, double value) {
  deck_.reading.currents[name] = value;
}
const Registry& DeckCard::registry() const { return deck_.registry; }
ModelBuilder& DeckCard::builder() { return deck_.builder; }

}  // namespace mbcosim
