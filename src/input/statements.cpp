#include "input/statements.h"

#include <algorithm>
#include <cmath>

#include "input/grammar/grammar.h"
#include "input/lexer.h"
#include "input/reading.h"
#include "input/splitter.h"

namespace mbcosim {

namespace {

using Body = std::vector<Statement>;

bool opens(const Statement& s) { return s.word == "for" || s.word == "if"; }
bool closes(const Statement& s) { return s.word == "endfor" || s.word == "endif"; }
bool is_control(const Statement& s) {
  return opens(s) || closes(s) || s.word == "else" || s.word == "elseif";
}

/// Where statements come from: a file, the body of a loop, or a branch of an `if`.
struct Source {
  std::optional<Splitter> file;
  std::shared_ptr<const Body> body;
  std::size_t next = 0, begin = 0, end = 0;  // in *body
  int trail = -1;
  int outer_trail = -1;  // of the card that opened this source

  // loops only
  bool loop = false;
  std::string name;
  std::int64_t first = 0, step = 1, passes = 0, pass = 0;
  SourceSpan where;
};

}  // namespace

struct Statements::Impl {
  explicit Impl(Reading& s) : reading(s) {
    if (reading.file_count() > 0) push_file(0, -1);
  }

  // ---------------------------------------------------------------------------------------------------------
  // statements
  std::optional<Statement> next() {
    while (!sources.empty() && !reading.full() && !reading.exited) {
      reading.set_damaged(false);
      reading.set_trail(sources.back().trail);
      std::optional<Statement> s = take();
      if (!s) {
        leave();
        continue;
      }
      try {
        count_statement(*s);
        if (!run(*s)) return s;
      } catch (DeckError& e) {
        add_form(e.diagnostic, "statement", s->word);
        reading.report(e.diagnostic);
      }
    }
    return std::nullopt;
  }

  void count_statement(const Statement& s) {
    if (++statements > reading.limits.statements)
      reading.fail_limit(
          head(s), "statements",
          "the deck has more than " + std::to_string(reading.limits.statements) + " statements");
    if (reading.out_of_time())
      reading.fail_limit(head(s), "read-time",
                         "reading the deck takes longer than " +
                             std::to_string(reading.options.read_time.count()) + " ms");
  }

  /// The next raw statement of the innermost source.
  std::optional<Statement> take() {
    Source& source = sources.back();
    std::optional<Statement> s;
    if (source.file)
      s = source.file->next();
    else if (source.next < source.end)
      s = (*source.body)[source.next++];
    if (s) s->trail = source.trail;
    return s;
  }

  /// The innermost source is exhausted.
  void leave() {
    Source& source = sources.back();
    if (source.loop) {
      reading.symbols.close_scope();
      reading.forget_trail(source.trail);
      if (++source.pass < source.passes) return start_pass(source);
    }
    sources.pop_back();
  }

  SourceSpan head(const Statement& s) const {
    return reading.span(s.file, s.offset, skip_words(s.text, 0));
  }
  [[noreturn]] void fail(const Statement& s, std::string message, std::string hint = "") const {
    reading.fail(head(s), std::move(message), std::move(hint));
  }

  void push_file(int file, int trail) {
    Source source;
    source.file.emplace(reading, file);
    source.trail = trail;
    sources.push_back(std::move(source));
  }

  // --------------------------------------------------------------------------------------------------------------
  // cards
  /// Does the cards that need no model; false for the others.
  bool run(const Statement& s) {
    const std::string& w = s.word;
    if (w == "set")
      set(s);
    else if (w == "include")
      include(s);
    else if (w == "remark")
      remark(s);
    else if (!reading.options.strict && is_control(s))
      control(s);
    else if (w == "printsymboltable")
      print_symbol_table(s);
    else if (w == "setenv")
      setenv(s);
    else if (w == "chdir")
      fail(s, "chdir is not allowed: a deck cannot change the working directory",
           "name files relative to the file that mentions them");
    else if (w == "exit")
      exit(s);
    else if (w == "license" || w == "warranty")
      notice(s);
    else
      return false;
    return true;
  }

  void no_arguments(const Statement& s, const char* card) const {
    if (!s.has_arguments) return;
    Cursor c(reading, s);
    reading.fail(c.next(), std::string(card) + ": unexpected argument");
  }

  void end_of_card(Cursor& c, const char* card, const char* which) const {
    if (c.more()) reading.fail(c.next(), std::string(card) + ": unexpected " + which + " argument");
  }

  void set(const Statement& s) {
    Cursor c(reading, s);
    if (!c.more())
      fail(s, "set: expression missing", "write \"set: real a = 1.;\" or \"set: a = 2.;\"");
    c.expression("set: expression");
    end_of_card(c, "set", "second");
  }

  void remark(const Statement& s) {
    const std::size_t colon = s.offset + (s.has_arguments ? s.arguments - 1 : 0);
    const SourceSpan where = reading.span(s.file, colon, 1);
    std::string line =
        "line " + std::to_string(where.line) + ", file <" + reading.file(s.file).name + ">";
    Cursor c(reading, s);
    for (int k = 1; c.more(); ++k) {
      if (c.at_empty())
        reading.fail(c.next(), "remark: argument " + std::to_string(k) + " is empty");
      line += (k == 1 ? ": " : ", ") + printed(c.expression("expression"));
      if (line.size() > reading.options.printed_bytes) break;
    }
    reading.print(where, line + '\n');
  }

  void include(const Statement& s) {
    Cursor c(reading, s);
    const std::string name = c.quoted("file name");
    const SourceSpan where = c.last();
    end_of_card(c, "include", "second");
    if (++includes > reading.limits.include_count)
      reading.fail_limit(
          where, "include-count",
          "more than " + std::to_string(reading.limits.include_count) + " files included");
    const Result<std::string> path = reading.resolve(name, s.file);
    if (!path) reading.fail(where, path.error().message, "", "file");
    const Result<int> file = reading.open_file(*path);
    if (!file) reading.fail_read(where, file.error(), s.file);
    check_chain(*file, where);
    Trail t;
    t.parent = s.trail;
    t.file = s.file;
    t.line = reading.span(s.file, s.offset, 1).line;
    push_file(*file, reading.add_trail(std::move(t)));
  }

  /// Refuses recursion and chains that are too long.
  void check_chain(int file, SourceSpan where) const {
    std::string chain;
    bool open = false;
    int depth = 0;
    for (const Source& source : sources) {
      if (!source.file) continue;
      ++depth;
      open = open || source.file->file() == file;
      if (open) chain += reading.file(source.file->file()).name + " -> ";
    }
    const std::string& name = reading.file(file).name;
    if (open)
      reading.fail(where, "recursive include of \"" + name + "\"; chain: " + chain + name,
                   "a file cannot include itself: remove this card, or name another file",
                   "recursive-include");
    if (depth > reading.limits.include_depth)
      reading.fail_limit(
          where, "include-depth",
          "files included deeper than " + std::to_string(reading.limits.include_depth) + " levels");
  }

  void print_symbol_table(const Statement& s) {
    Cursor c(reading, s);
    bool all = !c.more();
    while (c.more()) {
      const bool is_quoted = c.at_string();
      const std::string space = is_quoted ? c.quoted("namespace") : c.word("namespace");
      if (is_quoted)
        reading.warn(c.last(), "no namespace has a name in quotes: \"" + space + "\" ignored",
                     "write the name without quotes");
      else if (space == "all" || space == "default")
        all = true;
      else if (space != "model")
        reading.warn(c.last(), "unknown namespace \"" + space + "\" ignored");
    }
    if (!all) return;
    for (const Symbol* symbol : reading.symbols.sorted())
      reading.print(head(s), std::string("  ") + (symbol->constant ? "const " : "") +
                                 type_name(type_of(symbol->value)) + ' ' + symbol->name + " = " +
                                 printed(symbol->value) + '\n');
  }

  void setenv(const Statement& s) {
    Cursor c(reading, s);
    bool overwrite = false;
    if (c.peek_word() == "overwrite") {
      c.word("overwrite");
      const std::string answer = c.peek_word();
      if (answer == "yes" || answer == "no") {
        overwrite = c.word("answer") == "yes";
      } else {
        overwrite = is_true(c, c.expression("yes or no"));
      }
    }
    const std::string text = c.quoted("setenv: text");
    const std::size_t equal = text.find('=');
    if (equal == 0) reading.fail(c.last(), "setenv: name missing before \"=\"");
    const SourceSpan where = c.last();
    end_of_card(c, "setenv", "further");
    const std::string name = text.substr(0, equal);
    if (equal == std::string::npos)
      reading.environment.erase(name);
    else if (overwrite || !reading.environment.count(name))
      reading.environment[name] = text.substr(equal + 1);
    reading.warn(where,
                 "setenv acts only on the file names of this deck; the environment of the program "
                 "is not changed");
  }

  void exit(const Statement& s) {
    no_arguments(s, "exit");
    reading.exited = true;
  }

  void notice(const Statement& s) {
    no_arguments(s, s.word.c_str());
    reading.print(head(s), s.word == "license"
                               ? "mbcosim is distributed under the Apache License, Version 2.0.\n"
                               : "mbcosim comes without warranties or conditions of any kind.\n");
  }

  bool is_true(Cursor& c, const Value& v) const {
    if (const auto* b = std::get_if<bool>(&v)) return *b;
    if (const auto* i = std::get_if<std::int32_t>(&v)) return *i != 0;
    if (const auto* r = std::get_if<double>(&v)) return *r != 0;
    reading.fail(c.last(), "the condition must be a number, string found");
  }

  // -------------------------------------------------------------------------------------------------
  // loops, conditionals
  void control(const Statement& s) {
    if (s.word == "for") return start_loop(s);
    if (s.word == "if") return start_branch(s);
    const bool of_loop = s.word == "endfor";
    const std::string word = of_loop              ? "end for"
                             : s.word == "endif"  ? "end if"
                             : s.word == "elseif" ? "else if"
                                                  : "else";
    fail(s, "\"" + word + "\" without \"" + (of_loop ? "for" : "if") + '"');
  }

  /// The statements up to the closing card of `opening`, nested ones included. An `if` keeps its
  /// own `else if`, `else`.
  std::shared_ptr<Body> collect(const Statement& opening) {
    auto body = std::make_shared<Body>();
    std::vector<Statement> open = {opening};
    while (std::optional<Statement> s = take()) {
      count_statement(*s);
      if (opens(*s)) {
        if (static_cast<int>(open.size()) >= reading.limits.nesting_depth)
          reading.fail_limit(head(*s), "nesting-depth",
                             "\"for\" and \"if\" nested deeper than " +
                                 std::to_string(reading.limits.nesting_depth) + " levels");
        open.push_back(*s);
      }
      if (closes(*s)) {
        check_closing(open.back(), *s);
        open.pop_back();
        if (open.empty()) return body;
      }
      body->push_back(std::move(*s));
    }
    const Statement& last = open.back();
    fail(last, "\"" + last.word + "\" is not closed by \"end " + last.word + "\" in this file");
  }

  void check_closing(const Statement& opening, const Statement& closing) const {
    no_arguments(closing, closing.word == "endfor" ? "end for" : "end if");
    if (closing.word == "end" + opening.word) return;
    fail(closing, "\"" + opening.word + "\" begun at line " + std::to_string(head(opening).line) +
                      " closed by \"end " + closing.word.substr(3) + '"');
  }

  /// Blocks of the deck must be opened and closed within one body.
  void check_blocks(const Body& body, std::size_t begin, std::size_t end) const {
    const Statement* open = nullptr;
    for (std::size_t k = begin; k < end; ++k) {
      const Statement& s = body[k];
      if (s.word == "begin") {
        open = &s;
      } else if (s.word == "end") {
        if (!open) fail(s, "a block that was begun outside this body cannot be closed in it");
        open = nullptr;
      }
    }
    if (open)
      fail(*open, "a block that is begun in the body of a loop or condition must be closed in it");
  }

  std::int64_t bound(Cursor& c, const char* what) const {
    if (!c.more())
      reading.fail(c.next(), std::string("for: ") + what + " missing",
                   "for: integer k = first, last, step;");
    const Value v = c.expression(what);
    if (const auto* b = std::get_if<bool>(&v)) return *b;
    if (const auto* i = std::get_if<std::int32_t>(&v)) return *i;
    reading.fail(
        c.last(),
        std::string("for: ") + what + " must be an integer, " + type_name(type_of(v)) + " found",
        "write integer(...)");
  }

  void start_loop(const Statement& s) {
    std::shared_ptr<Body> body = collect(s);
    Source loop;
    loop.loop = true;
    loop.where = head(s);
    Statement rest = s;
    rest.arguments = read_loop_variable(s, &loop.name);
    Cursor c(reading, rest);
    loop.first = bound(c, "first value");
    const std::int64_t last = bound(c, "last value");
    if (c.more()) loop.step = bound(c, "step");
    if (loop.step == 0) reading.fail(c.last(), "for: the step must not be zero");
    end_of_card(c, "for", "fourth");
    if (const Symbol* known = reading.symbols.find(loop.name))
      fail(s, "for: name \"" + loop.name + "\" is already used" +
                  (known->where.file >= 0 ? ", declared at " + reading.place(known->where) : ""));
    check_blocks(*body, 0, body->size());
    const std::int64_t range = (last - loop.first) * (loop.step > 0 ? 1 : -1);
    loop.passes = range < 0 ? 0 : range / std::abs(loop.step) + 1;
    if (loop.passes > reading.limits.loop_iterations)
      reading.fail_limit(loop.where, "loop-iterations",
                         "for: " + std::to_string(loop.passes) + " passes exceed the limit of " +
                             std::to_string(reading.limits.loop_iterations));
    loop.end = body->size();
    loop.body = std::move(body);
    if (loop.passes == 0 || loop.end == 0 || reading.full()) return;
    loop.outer_trail = s.trail;
    sources.push_back(std::move(loop));
    start_pass(sources.back());
  }

  /// Reads `integer name =`; returns where the first value begins.
  std::size_t read_loop_variable(const Statement& s, std::string* name) const {
    const char* form = "for: integer k = first, last, step;";
    const auto expect = [&](bool good, std::size_t at, const char* what) {
      if (!good)
        reading.fail(reading.span(s.file, s.offset + std::min(at, s.text.size() - 1), 1),
                     std::string("for: ") + what + " expected", form);
    };
    std::size_t at = skip_blanks(s.text, s.arguments);
    std::size_t end = skip_identifier(s.text, at);
    expect(s.has_arguments && s.text.substr(at, end - at) == "integer", at, "\"integer\"");
    at = skip_blanks(s.text, end);
    expect(is_word_start(char_at(s.text, at)), at, "name of the variable");
    end = skip_identifier(s.text, at);
    *name = s.text.substr(at, end - at);
    at = skip_blanks(s.text, end);
    expect(char_at(s.text, at) == '=' && char_at(s.text, at + 1) != '=', at, "\"=\"");
    return at + 1;
  }

  void start_pass(Source& loop) {
    loop.next = loop.begin;
    Symbol variable;
    variable.name = loop.name;
    const auto value = static_cast<std::int32_t>(loop.first + loop.pass * loop.step);
    variable.value = value;
    variable.constant = true;
    variable.where = loop.where;
    reading.symbols.open_scope();
    reading.symbols.declare(std::move(variable));
    ++statements;
    Trail t;
    t.parent = loop.outer_trail;
    t.loop = true;
    t.file = loop.where.file;
    t.line = loop.where.line;
    t.name = loop.name;
    t.value = value;
    loop.trail = reading.add_trail(std::move(t));
  }

  struct Branch {
    const Statement* condition;  // null: else
    std::size_t begin, end;
  };

  std::vector<Branch> split_branches(const Statement& opening, const Body& body) const {
    std::vector<Branch> branches = {{&opening, 0, body.size()}};
    int depth = 0;
    for (std::size_t k = 0; k < body.size(); ++k) {
      const Statement& s = body[k];
      depth += opens(s) - closes(s);
      if (depth > 0 || (s.word != "else" && s.word != "elseif")) continue;
      const bool is_else = s.word == "else";
      if (!branches.back().condition)
        fail(s, is_else ? "second \"else\"" : "\"else if\" after \"else\"");
      if (is_else) no_arguments(s, "else");
      branches.back().end = k;
      branches.push_back({is_else ? nullptr : &s, k + 1, body.size()});
    }
    return branches;
  }

  void start_branch(const Statement& s) {
    const std::shared_ptr<Body> body = collect(s);
    for (const Branch& b : split_branches(s, *body)) {
      if (b.condition && !condition(*b.condition)) continue;
      check_blocks(*body, b.begin, b.end);
      Source source;
      source.body = body;
      source.begin = source.next = b.begin;
      source.end = b.end;
      source.trail = s.trail;
      sources.push_back(std::move(source));
      return;
    }
  }

  bool condition(const Statement& s) {
    Cursor c(reading, s);
    if (!c.more()) fail(s, "condition missing");
    const bool is = is_true(c, c.expression("condition"));
    end_of_card(c, s.word == "if" ? "if" : "else if", "second");
    return is;
  }

  Reading& reading;
  std::vector<Source> sources;
  std::int64_t statements = 0;
  std::int64_t includes = 0;
};

Statements::Statements(Reading& reading) : impl_(std::make_unique<Impl>(reading)) {}
Statements::~Statements() = default;

std::optional<Statement> Statements::next() { return impl_->next(); }

}  // namespace mbcosim
