#include <charconv>
#include <cmath>

#include "input/grammar/grammar.h"
#include "input/lexer.h"
#include "input/nearest.h"
#include "input/syntax.h"

namespace mbcosim {

bool find_type(std::string_view name, ValueType* type) {
  constexpr ValueType all[] = {ValueType::boolean, ValueType::integer, ValueType::real,
                               ValueType::string};
  for (const ValueType t : all) {
    if (name != type_name(t)) continue;
    *type = t;
    return true;
  }
  return false;
}

namespace {

/// Recursive descent. Binding from weak to strong, all to the left but `^`:
///
///     = (a statement)     && || ~|     > >= == <= < !=     + -     * / %     ^     one sign or !
class Parser {
 public:
  Parser(std::string_view text, std::size_t begin, bool is_string, const Limits& limits,
         Syntax* syntax)
      : text_(text), at_(begin), is_string_(is_string), limits_(limits), out_(*syntax) {}

  std::size_t argument() {
    statement();
    if (at_ < text_.size() && text_[at_] != ',') unexpected();
    return at_;
  }

  void whole_string() {
    blanks();
    if (at_ >= text_.size()) fail(0, text_.size(), "empty expression");
    list();
    if (at_ < text_.size()) unexpected();
  }

 private:
  enum class Last { nothing, number, word, other };

  // -------------------------------------------------------------------------------------------------------
  // characters
  void blanks() {
    while (at_ < text_.size()) {
      if (is_blank(text_[at_])) {
        ++at_;
      } else if (text_[at_] == '#') {
        at_ = skip_line_comment(text_, at_);
      } else if (text_[at_] == '/' && peek(1) == '*') {
        const std::size_t end = skip_block_comment(text_, at_);
        if (end == std::string_view::npos) fail(at_, 2, "unterminated comment");
        at_ = end;
      } else {
        return;
      }
    }
  }
  char peek(std::size_t k = 0) const { return char_at(text_, at_ + k); }
  bool accept(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }

  [[noreturn]] static void fail(std::size_t where, std::size_t length, const std::string& message,
                                const std::string& hint = "", const std::string& code = "syntax") {
    throw ExpressionError(where, length, message, hint, code);
  }

  std::string_view token(std::size_t at) const {
    std::size_t end = at;
    if (is_word_start(char_at(text_, at)))
      end = skip_identifier(text_, at);
    else if (is_digit(char_at(text_, at)) || char_at(text_, at) == '.')
      while (is_word_char(char_at(text_, end)) || char_at(text_, end) == '.') ++end;
    else if (char_at(text_, at) == '"')
      end = std::min(skip_string(text_, at), text_.size());
    else
      return character_at(text_, at);
    return text_.substr(at, end - at);
  }

  [[noreturn]] void fail_unexpected(std::string_view found) {
    fail(at_, found.size(), "unexpected " + in_quotes(excerpt(found)),
         is_ascii(peek()) ? "" : kAsciiAlone);
  }

  /// What stands at the present place can neither continue nor end the expression.
  [[noreturn]] void unexpected() {
    const char c = peek();
    if (!is_string_ && begins_card(text_, at_)) fail_missing_semicolon(at_);
    const std::string_view found = token(at_);
    if (c == ')' || c == ']') fail(at_, 1, "unexpected " + in_quotes(found));
    if (is_word_char(c) || c == '.' || c == '"') {
      const std::string_view before = text_.substr(last_begin_, last_end_ - last_begin_);
      if (last_ != Last::nothing && last_ != Last::other) {
        if (last_end_ == at_)
          fail(at_, found.size(),
               "operator expected between " + in_quotes(before) + " and " + in_quotes(found));
        if (depth_ == 0 && last_ == Last::word && is_word_start(c) && !is_string_)
          fail_words(before, found);
      }
      if (depth_ > 0)
        fail(at_, found.size(), "operator or \")\" expected before " + in_quotes(excerpt(found)));
      if (is_string_)
        fail(at_, found.size(), "operator or \";\" expected before " + in_quotes(excerpt(found)));
      fail(at_, found.size(),
           "separator \",\" or \";\" expected before " + in_quotes(excerpt(found)), "",
           "separator");
    }
    if (c == '&' || c == '|' || c == '~')
      fail(at_, 1,
           "operator " + in_quotes(found) +
               " is not known; the logical operators are &&, || and ~|");
    if (c == '=')
      fail(at_, 1, "unexpected \"=\"",
           "comparison is ==; an assignment inside an expression needs parentheses");
    fail_unexpected(found);
  }

  /// Two words: one that the argument before needed is left out, or a comma between two values.
  [[noreturn]] void fail_words(std::string_view before, std::string_view found) {
    const std::size_t end = skip_words(text_, last_begin_);
    const std::string_view all = text_.substr(last_begin_, end - last_begin_);
    if (is_word_of_language(all))
      fail(last_begin_, all.size(), "a value expected, found the word " + in_quotes(all));
    fail(at_, found.size(), "\",\" expected after " + in_quotes(before), "", "separator");
  }

  [[noreturn]] void fail_missing_semicolon(std::size_t where) const {
    fail(where, skip_words(text_, where) - where, "", "", "missing-semicolon");
  }

  struct Nesting {
    Nesting(Parser* p, std::size_t where) : parser(p) {
      if (++p->nesting_ > p->limits_.expression_depth)
        fail(where, 1,
             "expression nested deeper than " + std::to_string(p->limits_.expression_depth) +
                 " levels (limit `expression-depth`)",
             "", "limit-expression-depth");
    }
    ~Nesting() { --parser->nesting_; }
    Parser* parser;
  };

  // ------------------------------------------------------------------------------------------------------------
  // items
  SyntaxItem& add(Form form, std::size_t where, std::size_t end) {
    SyntaxItem& item = out_.items.emplace_back();
    item.form = form;
    item.where = static_cast<std::uint32_t>(where);
    item.length = static_cast<std::uint32_t>(end - where);
    return item;
  }
  void add_operator(Form form, Operator op, std::size_t where, std::size_t length) {
    add(form, where, where + length).op = op;
  }
  void consumed(Last kind, std::size_t begin) {
    last_ = kind;
    last_begin_ = begin;
    last_end_ = at_;
  }

  // ----------------------------------------------------------------------------------------------------------
  // grammar
  void list() {
    statement();
    while (peek() == ';') {
      const std::size_t where = at_++;
      blanks();
      if (at_ >= text_.size() || peek() == ';' || peek() == ')')
        fail(where, 1, "statement missing after \";\"");
      add(Form::drop, where, where + 1);
      statement();
    }
  }

  void statement() {
    blanks();
    if (is_word_start(peek())) {
      const std::size_t start = at_;
      if (declaration()) return;
      at_ = start;
      if (assignment()) return;
      at_ = start;
    }
    logical();
  }

  std::string_view identifier() {
    const std::size_t begin = at_;
    at_ = skip_identifier(text_, at_);
    const std::string_view name = text_.substr(begin, at_ - begin);
    consumed(Last::word, begin);
    return name;
  }

  /// `name` or `space::name`.
  void qualified(std::string_view* name_space, std::string_view* name) {
    *name_space = {};
    *name = identifier();
    blanks();
    if (peek() != ':' || peek(1) != ':') return;
    const std::size_t colons = at_;
    at_ += 2;
    blanks();
    if (!is_word_start(peek())) fail(colons, 2, "name expected after \"::\"");
    const std::size_t begin = at_;
    while (is_word_char(peek()) || peek() == ':') ++at_;
    *name_space = *name;
    *name = text_.substr(begin, at_ - begin);
    consumed(Last::word, begin);
    blanks();
  }

  bool is_assignment() const { return peek() == '=' && peek(1) != '='; }

  bool declaration() {
    SyntaxItem item;
    std::string_view word = next_word();
    if (word == "ifndef" && is_word_start(peek())) {
      item.if_undefined = true;
      word = next_word();
    }
    if (word == "const" && is_word_start(peek())) {
      item.is_constant = true;
      word = next_word();
    }
    if (!find_type(word, &item.type)) {
      if (item.if_undefined || item.is_constant) fail_type(word);
      return false;
    }
    if (!is_word_start(peek())) {
      if (item.if_undefined || item.is_constant || (peek() != '(' && !is_assignment()))
        fail(at_, token(at_).size(), "variable name expected after " + in_quotes(word));
      return false;
    }
    const std::size_t where = at_;
    qualified(&item.name_space, &item.name);
    item.where = static_cast<std::uint32_t>(where);
    item.length = static_cast<std::uint32_t>(last_end_ - where);
    item.form = Form::declare;
    finish_declaration(item);
    return true;
  }

  std::string_view next_word() {
    const std::string_view word = identifier();
    blanks();
    return word;
  }

  void finish_declaration(SyntaxItem item) {
    item.has_value = is_assignment();
    out_.declared.push_back(item);
    if (item.has_value) {
      ++at_;
      value(&item);
    } else if (peek() != ';' && (at_ < text_.size() || depth_ > 0)) {
      if (depth_ == 0 && peek() != ',') unexpected();
      fail(item.where, item.length, "a declaration without a value must be followed by \";\"");
    }
    out_.items.push_back(item);
  }

  /// Right-hand side of `=`.
  void value(SyntaxItem* item) {
    blanks();
    item->value_where = static_cast<std::uint32_t>(at_);
    logical();
    item->value_length = static_cast<std::uint32_t>(last_end_ - item->value_where);
    if (is_assignment()) fail(at_, 1, "an assignment inside an expression needs parentheses");
  }

  bool assignment() {
    SyntaxItem item;
    const std::size_t where = at_;
    qualified(&item.name_space, &item.name);
    if (!is_assignment()) {
      check_unknown_type(where, item);
      return false;
    }
    item.form = Form::assign;
    item.where = static_cast<std::uint32_t>(where);
    item.length = static_cast<std::uint32_t>(last_end_ - where);
    ++at_;
    value(&item);
    out_.items.push_back(item);
    return true;
  }

  /// `int a = 3`: two words before `=`, and the first is no type.
  void check_unknown_type(std::size_t where, const SyntaxItem& item) {
    if (!item.name_space.empty() || !is_word_start(peek()) || begins_card(text_, at_)) return;
    const std::size_t end = skip_blanks(text_, skip_identifier(text_, at_));
    if (char_at(text_, end) != '=' || char_at(text_, end + 1) == '=') return;
    at_ = where;
    fail_type(identifier());
  }

  [[noreturn]] void fail_type(std::string_view word) {
    Nearest nearest(word);
    for (const char* known : {"bool", "integer", "real", "string"}) nearest.consider(known);
    std::string best = nearest.best();
    if (word == "int" || word == "long" || word == "unsigned") best = "integer";
    if (word == "double" || word == "float") best = "real";
    fail(last_begin_, word.size(),
         "unknown type " + in_quotes(word) +
             (best.empty() ? "; the types are bool, integer, real and string"
                           : "; did you mean " + in_quotes(best) + "?"),
         "", "unknown-type");
  }

  void logical() {
    relational();
    while (true) {
      Operator op;
      if (peek() == '&' && peek(1) == '&')
        op = Operator::logical_and;
      else if (peek() == '|' && peek(1) == '|')
        op = Operator::logical_or;
      else if (peek() == '~' && peek(1) == '|')
        op = Operator::logical_xor;
      else
        return;
      const std::size_t where = at_;
      at_ += 2;
      relational();
      add_operator(Form::binary, op, where, 2);
    }
  }

  bool relation(Operator* op, int* length) {
    const bool equal = peek(1) == '=';
    *length = equal ? 2 : 1;
    switch (peek()) {
      case '<':
        *op = equal ? Operator::less_equal : Operator::less;
        return true;
      case '>':
        *op = equal ? Operator::greater_equal : Operator::greater;
        return true;
      case '=':
        *op = Operator::equal;
        return equal;
      case '!':
        *op = Operator::not_equal;
        return equal;
      default:
        return false;
    }
  }

  void relational() {
    additive();
    Operator op;
    int length;
    while (relation(&op, &length)) {
      const std::size_t where = at_;
      at_ += length;
      additive();
      add_operator(Form::binary, op, where, length);
    }
  }

  void additive() {
    multiplicative();
    while (peek() == '+' || peek() == '-') {
      const Operator op = peek() == '+' ? Operator::add : Operator::subtract;
      const std::size_t where = at_++;
      multiplicative();
      add_operator(Form::binary, op, where, 1);
    }
  }

  void multiplicative() {
    power();
    while (peek() == '*' || peek() == '/' || peek() == '%') {
      const Operator op = peek() == '*'   ? Operator::multiply
                          : peek() == '/' ? Operator::divide
                                          : Operator::modulo;
      const std::size_t where = at_++;
      power();
      add_operator(Form::binary, op, where, 1);
    }
  }

  void power() {
    unary();
    if (peek() != '^') return;
    const Nesting nesting(this, at_);
    const std::size_t where = at_++;
    power();
    add_operator(Form::binary, Operator::power, where, 1);
  }

  void unary() {
    blanks();
    const char c = peek();
    if (c != '+' && c != '-' && c != '!') return primary();
    const std::size_t where = at_++;
    blanks();
    if (peek() == '+' || peek() == '-' || peek() == '!')
      fail(where, at_ + 1 - where, "two consecutive unary operators; use parentheses");
    primary();
    add_operator(Form::unary,
                 c == '+'   ? Operator::plus
                 : c == '-' ? Operator::minus
                            : Operator::negate,
                 where, 1);
  }

  void primary() {
    const char c = peek();
    if (is_digit(c) || (c == '.' && is_digit(peek(1))))
      number();
    else if (is_word_start(c))
      name_or_call();
    else if (c == '(')
      parentheses();
    else if (c == '"')
      text();
    else if (c == '[')
      plugin();
    else
      fail_operand();
    blanks();
  }

  [[noreturn]] void fail_operand() {
    std::size_t before = at_;
    while (before > 0 && is_blank(text_[before - 1])) --before;
    const char previous = before > 0 ? text_[before - 1] : '\0';
    const bool after_operator =
        previous && std::string_view("+-*/%^<>=!&|~").find(previous) != std::string_view::npos;
    if (after_operator)
      fail(before - 1, 1, std::string("operand missing after \"") + previous + "\"");
    if (at_ >= text_.size()) fail(at_ ? at_ - 1 : 0, 1, "expression expected");
    if (peek() == ',' || peek() == ';')
      fail(at_, 1, "expression expected before " + in_quotes(token(at_)));
    fail_unexpected(token(at_));
  }

  void parentheses() {
    const Nesting nesting(this, at_);
    const std::size_t open = at_++;
    ++depth_;
    blanks();
    if (peek() == ')') fail(open, at_ + 1 - open, "expression expected between \"(\" and \")\"");
    list();
    close(open);
    consumed(Last::other, open);
  }

  void close(std::size_t open) {
    if (at_ >= text_.size()) fail(open, 1, "unbalanced \"(\"");
    if (!accept(')')) unexpected();
    --depth_;
  }

  void text() {
    const std::size_t begin = at_;
    const std::size_t end = skip_string(text_, begin);
    if (end == std::string_view::npos) fail(begin, 1, "unterminated string");
    at_ = end;
    SyntaxItem& item = add(Form::text, begin, end);
    item.text = static_cast<std::uint32_t>(out_.texts.size());
    out_.texts.push_back(decode_literal(text_.substr(begin + 1, end - begin - 2)));
    consumed(Last::other, begin);
  }

  void plugin() {
    const std::size_t begin = at_++;
    while (at_ < text_.size() && text_[at_] != ']') {
      if (text_[at_] == '"')
        at_ = std::min(skip_string(text_, at_), text_.size());
      else
        ++at_;
    }
    if (!accept(']')) fail(begin, 1, "unbalanced \"[\"");
    add(Form::plugin, begin, at_).name = text_.substr(begin + 1, at_ - begin - 2);
    consumed(Last::other, begin);
  }

  void name_or_call() {
    SyntaxItem item;
    const std::size_t where = at_;
    qualified(&item.name_space, &item.name);
    item.form = Form::name;
    item.where = static_cast<std::uint32_t>(where);
    item.length = static_cast<std::uint32_t>(last_end_ - where);
    if (peek() == '(') {
      item.form = Form::call;
      item.count = call_arguments();
      item.value_length = static_cast<std::uint32_t>(last_end_ - where);
    }
    out_.items.push_back(item);
  }

  int call_arguments() {
    const Nesting nesting(this, at_);
    const std::size_t open = at_++;
    ++depth_;
    int count = 0;
    blanks();
    if (peek() != ')') {
      do {
        list();
        ++count;
      } while (accept(','));
    }
    close(open);
    consumed(Last::other, open);
    return count;
  }

  // ----------------------------------------------------------------------------------------------------------
  // numbers
  void number() {
    const std::size_t begin = at_;
    if (peek() == '0' && (peek(1) == 'x' || peek(1) == 'X'))
      fail(begin, token(begin).size(), "hexadecimal numbers are not supported");
    digits();
    bool real = accept('.');
    if (real) digits();
    if (peek() == '.') {
      std::size_t end = at_;
      while (is_digit(char_at(text_, end)) || char_at(text_, end) == '.') ++end;
      fail(begin, end - begin, "malformed number " + in_quotes(text_.substr(begin, end - begin)));
    }
    const std::size_t mantissa = at_;
    real = exponent(begin) || real;
    consumed(Last::number, begin);
    if (real)
      real_literal(begin, mantissa);
    else
      integer_literal(begin);
    if (is_word_start(peek())) unexpected();
  }

  void digits() {
    while (is_digit(peek())) ++at_;
  }

  bool exponent(std::size_t begin) {
    constexpr std::string_view letters = "eEfFdDgG";
    if (letters.find(peek()) == std::string_view::npos || peek() == '\0') return false;
    const std::size_t sign = peek(1) == '+' || peek(1) == '-' ? 1 : 0;
    if (is_digit(peek(1 + sign))) {
      at_ += 1 + sign;
      digits();
      return true;
    }
    if (sign == 0 && is_word_char(peek(1))) {
      consumed(Last::number, begin);
      unexpected();
    }
    const std::size_t end = at_ + 1 + sign;
    fail(begin, end - begin,
         "exponent digits missing in " + in_quotes(text_.substr(begin, end - begin)));
  }

  void integer_literal(std::size_t begin) {
    std::int32_t value = 0;
    const auto [end, error] = std::from_chars(text_.data() + begin, text_.data() + at_, value);
    if (error != std::errc()) {
      const std::string digits(text_.substr(begin, at_ - begin));
      fail(begin, at_ - begin, "integer literal out of range; write " + digits + ". for a real");
    }
    add(Form::integer, begin, at_).integer = value;
  }

  void real_literal(std::size_t begin, std::size_t mantissa) {
    std::string_view digits = text_.substr(begin, at_ - begin);
    std::string spelled;
    if (mantissa < at_ && (text_[mantissa] | 0x20) != 'e') {
      spelled = digits;
      spelled[mantissa - begin] = 'e';
      digits = spelled;
    }
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool nonzero =
        digits.substr(0, mantissa - begin).find_first_of("123456789") != std::string_view::npos;
    if (error != std::errc() || std::isinf(value) || (value == 0 && nonzero)) {
      const bool small = mantissa < at_ && char_at(text_, mantissa + 1) == '-';
      fail(begin, at_ - begin, small ? "real literal underflows" : "real literal overflows");
    }
    add(Form::real, begin, at_).real = value;
  }

  std::string_view text_;
  std::size_t at_;
  bool is_string_;
  const Limits& limits_;
  Syntax& out_;
  int depth_ = 0;    // open parentheses
  int nesting_ = 0;  // open recursions
  Last last_ = Last::nothing;
  std::size_t last_begin_ = 0, last_end_ = 0;
};

}  // namespace

std::size_t parse_argument(std::string_view text, std::size_t begin, const Limits& limits,
                           Syntax* syntax) {
  syntax->clear();
  return Parser(text, begin, false, limits, syntax).argument();
}

void parse_string(std::string_view text, const Limits& limits, Syntax* syntax) {
  syntax->clear();
  Parser(text, 0, true, limits, syntax).whole_string();
}

}  // namespace mbcosim
