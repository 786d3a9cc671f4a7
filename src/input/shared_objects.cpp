/// Drives, template drives, constitutive laws, functions, fluids: defined in place or referred to
/// by label.
#include <cctype>

#include "input/deck.h"
#include "input/deck_card.h"
#include "input/run_strings.h"
#include "input/suggest.h"
#include "model/drives/template_drives.h"
#include "model/law.h"

namespace mbcosim {

namespace {

/// Does an expression mention what changes during the run?
bool mentions_run_variables(const SymbolTable& symbols, std::string_view text) {
  if (text.starts_with('[')) return true;
  const auto is_name = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  for (std::size_t i = 0; i < text.size();) {
    if (!is_name(text[i])) {
      ++i;
      continue;
    }
    std::size_t n = i;
    while (n < text.size() && is_name(text[n])) ++n;
    const std::string_view name = text.substr(i, n - i);
    if (name == "Time" || name == "TimeStep" || name == "Step" || name == "Var") return true;
    if (name == "model" && text.substr(n, 2) == "::") return true;
    if (const Symbol* const symbol = symbols.find(name); symbol && symbol->plugin) return true;
    i = n;
  }
  return false;
}

template <class Value>
std::vector<std::string> written_words(const WordTable<Value>& table) {
  std::vector<std::string> words;
  for (const auto& entry : table) words.emplace_back(entry.word);
  return words;
}

template <class T>
const T& labelled(DeckCard& card, const LabelMap<T>& map, const std::string& kind) {
  const int label = card.label(kind + " label");
  const auto found = map.find(label);
  if (found == map.end()) card.fail_undefined(card.last(), kind, label);
  card.refer(kind + " " + std::to_string(label), found->second.weight);
  return found->second.object;
}

}  // namespace

template <class Table>
void DeckCard::fail_word(std::string_view what, const std::string& word, const Table& table,
                         const std::string& context) {
  const SourceSpan where = next();
  refuse_unsupported(where, context, word);
  fail_at(where, "unknown " + std::string(what) + " \"" + word + "\"",
          suggested_word(word, written_words(table)), "unknown-word");
}

// ----------------------------------------------------------------------------------------------
// drives

DrivePtr DeckCard::constant_drive(std::string_view what) {
  const std::string w = peek_word();
  const SourceSpan where = next();
  const std::string_view text = next_text();
  // A lone word that is neither a drive nor a variable is most likely a mistyped keyword.
  if (!w.empty() && !deck_.reading.symbols.find(text))
    fail_word("drive or variable", w, registry().drives, "drive");
  if (mentions_run_variables(deck_.reading.symbols, text))
    warn_at(where, std::string(what) + ": value frozen at input time; use a string drive");
  return make_constant_drive(real(what));
}

DrivePtr DeckCard::drive(std::string_view what) {
  need_argument(what);
  if (cursor_.at_empty()) {
    skip();
    return make_constant_drive(0);
  }
  if (at_string())
    fail_expected(std::string(what) + ": drive expected, string found",
                  "write: string, \"<expression>\"");
  const Nesting nesting(*this);
  if (keyword("reference")) return labelled(*this, deck_.drives, "drive caller");
  keyword("function");
  const auto* const found = registry().drives.find(peek_word());
  if (!found) return constant_drive(what);
  accept_word();
  return read_as("drive", found->key, found->value);
}

DrivePtr DeckCard::string_expression(const std::string& text) {
  return compile_string(deck_.reading, text, last());
}

ExpressionPtr DeckCard::expression_of(const std::string& text,
                                      const std::vector<std::string>& names) {
  return compile_expression(deck_.reading, text, names, last());
}

// ----------------------------------------------------------------------------------------------
// template drives

namespace {

template <int R, int C>
LabelMap<TplDrivePtr<R, C>>& template_drives(Deck& deck) {
  if constexpr (C == 6)
    return deck.drives66;
  else if constexpr (C == 3)
    return deck.drives33;
  else if constexpr (R == 3)
    return deck.drives3;
  else
    return deck.drives6;
}

}  // namespace

template <int R, int C>
TplDrivePtr<R, C> DeckCard::component_drive(std::string_view what) {
  std::vector<DrivePtr> drives(R * C);
  const auto one = [&](int i, int j) {
    if (keyword("inactive")) return DrivePtr();
    return drive(std::string(what) + (C > 1 ? ", component (" + std::to_string(i + 1) + "," +
                                                  std::to_string(j + 1) + ")"
                                            : ", component " + std::to_string(i + 1)));
  };
  const int form = C > 1 ? one_of({"sym", "diag"}) : -1;
  for (int i = 0; i < R; ++i)
    for (int j = 0; j < C; ++j) {
      if ((form == 0 && j < i) || (form == 1 && j != i)) continue;
      drives[j * R + i] = one(i, j);
      if (form == 0) drives[i * R + j] = drives[j * R + i];
    }
  return std::make_shared<ComponentTplDrive<R, C>>(std::move(drives));
}

template <int R, int C, class ReadEntity>
TplDrivePtr<R, C> DeckCard::template_drive(std::string_view what, ReadEntity read) {
  using Sum = SumTplDrive<R, C>;
  need_argument(what);
  std::vector<typename Sum::Term> terms;
  const auto term = [&] {
    const SourceSpan where = more() ? next() : last();
    const typename Sum::Value entity = read();
    if (entity.isZero(0))
      warn_at(where, std::string(what) + ": the direction is null, whatever the drive gives",
              "give a direction, or leave the card out");
    terms.push_back({entity, drive(std::string(what) + ": drive")});
  };
  switch (one_of({"null", "component", "array", "reference", "zero", "single"})) {
    case 0:
    case 4:
      break;
    case 1:
      return component_drive<R, C>(what);
    case 2: {
      const int n = integer_at_least("number of drives in the array", 1);
      for (int i = 0; i < n; ++i) term();
      break;
    }
    case 3:
      return labelled(*this, template_drives<R, C>(deck_), "template drive caller");
    default:
      term();
  }
  return std::make_shared<Sum>(std::move(terms));
}

Vec3DrivePtr DeckCard::vec3_drive(std::string_view what, const VectorAxes& axes) {
  return template_drive<3, 1>(what, [&] { return free_vector(what, axes); });
}
TplDrivePtr<6> DeckCard::vec6_drive(std::string_view what) {
  return template_drive<6, 1>(what, [&] { return vec6(what); });
}
TplDrivePtr<3, 3> DeckCard::mat3_drive(std::string_view what) {
  return template_drive<3, 3>(what, [&] { return mat3(what); });
}
TplDrivePtr<6, 6> DeckCard::mat6_drive(std::string_view what) {
  return template_drive<6, 6>(what, [&] { return mat6(what); });
}
DrivePtr DeckCard::scalar_template_drive(std::string_view what) {
  need_argument(what);
  if (!keyword("reference")) {
    one_of({"component", "single"});
    return drive(what);
  }
  const int label = this->label("template drive caller label");
  const auto found = deck_.drives1.find(label);
  const std::string number = std::to_string(label);
  if (found != deck_.drives1.end()) {
    refer("template drive caller " + number, found->second.weight);
    return found->second.object;
  }
  fail_undefined(last(), "template drive caller", label,
                 deck_.drives.count(label)
                     ? "write `component, reference, " + number + "` for drive caller " + number
                     : "");
}

// ----------------------------------------------------------------------------------------------
// laws

namespace {

template <int N>
const auto& law_readers(const Registry& r) {
  if constexpr (N == 1)
    return r.laws1;
  else if constexpr (N == 3)
    return r.laws3;
  else
    return r.laws6;
}
template <int N>
const LabelMap<LawPtr<N>>& laws(const Deck& d) {
  if constexpr (N == 1)
    return d.laws1;
  else if constexpr (N == 3)
    return d.laws3;
  else
    return d.laws6;
}

/// A law that exists in other dimensions only.
void refuse_word_of_other_dimension(DeckCard& card, const std::string& word, int dimension) {
  const Registry& r = card.registry();
  std::string others, shown;
  const auto add = [&](const auto& readers, const char* text) {
    const auto* const found = readers.find(word);
    if (!found) return;
    shown = found->word;
    others += (others.empty() ? "" : ", ") + std::string(text);
  };
  add(r.laws1, "1");
  add(r.laws3, "3");
  add(r.laws6, "6");
  if (others.empty()) return;
  card.fail_at(card.next(), "constitutive law \"" + shown + "\" has no form in dimension " +
                                std::to_string(dimension) + "; it exists in dimension " + others);
}

}  // namespace

/// After `reference`: refuses the label of a law that was defined in other dimensions only.
template <int N>
void DeckCard::refuse_other_dimension() {
  const std::string text(next_text());
  const auto defined = [&](const auto& map) {
    return std::any_of(map.begin(), map.end(),
                       [&](const auto& entry) { return std::to_string(entry.first) == text; });
  };
  if (defined(laws<N>(deck_))) return;
  const int other = defined(deck_.laws1)   ? 1
                    : defined(deck_.laws3) ? 3
                    : defined(deck_.laws6) ? 6
                                           : 0;
  if (other != 0)
    fail_at(next(), "constitutive law " + text + " has dimension " + std::to_string(other) +
                        "; dimension " + std::to_string(N) + " is needed here");
}

template <int N>
LawPtr<N> DeckCard::law_of() {
  need_argument("constitutive law");
  const Nesting nesting(*this);
  if (keyword("reference")) {
    refuse_other_dimension<N>();
    const LawPtr<N>& law = labelled(*this, laws<N>(deck_), "constitutive law");
    const LawPtr<N> copy = law->copy(builder());
    return copy ? copy : law;
  }
  const auto& readers = law_readers<N>(registry());
  const std::string w = peek_word();
  if (const auto* const found = readers.find(w)) {
    accept_word();
    return read_as("law", found->key, found->value);
  }
  const auto* const linear = readers.find("linearelastic");
  if (N == 1 && linear && (w.empty() || deck_.reading.symbols.find(next_text())))
    return read_as("law", linear->key, linear->value);
  if (w.empty())
    fail_expected("constitutive law expected, e.g. " +
                  std::string(N == 1 ? "linear elastic" : "linear elastic generic"));
  refuse_word_of_other_dimension(*this, w, N);
  fail_word("constitutive law", w, readers, "law");
}

LawPtr<1> DeckCard::law1() { return law_of<1>(); }
LawPtr<3> DeckCard::law3() { return law_of<3>(); }
LawPtr<6> DeckCard::law6() { return law_of<6>(); }

// ----------------------------------------------------------------------------------------------
// functions and fluids

bool DeckCard::at_expression() {
  return more() && !at_string() && !at_empty() &&
         (peek_word().empty() || deck_.reading.symbols.find(next_text()));
}

ScalarFunctionPtr DeckCard::function_definition(const std::string& name, SourceSpan where) {
  const Nesting nesting(*this);
  auto& functions = deck_.reading.functions;
  if (const auto known = functions.find(name); known != functions.end())
    fail_at(where,
            "scalar function \"" + name + "\" already defined at " +
                deck_.reading.place(known->second.where),
            "", "redefinition");
  const std::string w = peek_word();
  const auto* found = registry().functions.find(w);
  if (found)
    skip();
  else if (at_expression())
    found = registry().functions.find("const");
  if (!found) {
    if (!more()) fail("scalar function type missing", "", "missing-argument");
    if (w.empty())
      fail_expected("scalar function type expected, e.g. const, linear, multilinear, cubic spline");
    fail_word("scalar function", w, registry().functions, "function");
  }
  ScalarFunctionPtr f = read_as("function", found->key, found->value);
  functions[name] = {f, where, weight_};
  return f;
}

void DeckCard::read_function_definition() {
  const std::string name = quoted("scalar function name");
  set_defining("scalar function \"" + name + "\"");
  set_subject("scalar function \"" + name + "\"");
  function_definition(name, last());
}

ScalarFunctionPtr DeckCard::scalar_function(std::string_view what) {
  const std::string name = quoted(std::string(what) + " name");
  const SourceSpan where = last();
  if (registry().functions.find(peek_word())) return function_definition(name, where);
  const auto& functions = deck_.reading.functions;
  if (const auto known = functions.find(name); known != functions.end()) {
    refer("scalar function \"" + name + "\"", known->second.weight);
    return known->second.object;
  }
  if (deck_.damaged_kinds.count("scalar function \"" + name + "\""))
    deck_.reading.set_damaged(true);
  else if (at_expression())
    return function_definition(name, where);
  fail_at(where, "scalar function \"" + name + "\" is not defined",
          suggested_function(name, functions), "undefined");
}

FluidPtr DeckCard::fluid() {
  need_argument("hydraulic fluid");
  if (one_of({"hydraulic fluid", "fluid"}) < 0)
    fail_expected("the word \"fluid\" expected before the hydraulic fluid");
  if (keyword("reference")) return labelled(*this, deck_.fluids, "hydraulic fluid");
  return fluid_definition();
}

FluidPtr DeckCard::fluid_definition() {
  need_argument("hydraulic fluid");
  const Nesting nesting(*this);
  const std::string w = peek_word();
  const auto* const found = registry().fluids.find(w);
  if (!found) {
    const auto* const plain = registry().fluids.find("incompressible");
    if (plain && (w == "density" || w == "viscosity"))
      return read_as("fluid", plain->key, plain->value);
    if (w.empty())
      fail_expected(
          "hydraulic fluid expected: \"reference, <label>\" or a type such as linear compressible");
    fail_word("hydraulic fluid", w, registry().fluids, "fluid");
  }
  skip();
  return read_as("fluid", found->key, found->value);
}

FileDriverPtr DeckCard::file_driver() { return labelled(*this, deck_.file_drivers, "file driver"); }

FileDriverPtr DeckCard::file_driver_definition(int label) {
  need_argument("file driver type");
  const std::string w = peek_word();
  const auto* const found = registry().file_drivers.find(w);
  if (!found) fail_word("file driver type", w, registry().file_drivers, "file driver");
  skip();
  set_form("file driver", found->key);
  return found->value(*this, label);
}

}  // namespace mbcosim
