#include "input/reading.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "input/evaluate.h"
#include "input/lexer.h"
#include "input/pending_string.h"
#include "model/model.h"

namespace mbcosim {

Reading::Reading(const FileSource& source, Limits limits_in, ModelBuilder* builder,
                 ReaderOptions options_in)
    : limits(limits_in),
      options(options_in),
      source_(source),
      builder_(builder),
      read_until_(std::chrono::steady_clock::now() + options_in.read_time),
      empty_context_(std::make_unique<EvalContext>()),
      scratch_(std::make_unique<ExpressionScratch>()) {
  empty_context_->phase = Phase::input;
  seed(1);
}

Reading::~Reading() {
  for (const auto& s : pending_) s->detach();
}

// --------------------------------------------------------------------------------------------------------------
// files

Result<std::string> Reading::read_counted(const std::string& name) {
  Result<std::string> text = source_.read(name);
  if (!text) return text;
  bytes_ += static_cast<std::int64_t>(text->size());
  if (bytes_ > limits.deck_bytes)
    return make_error(
        ErrorKind::limit, "deck-bytes",
        "the deck and its files exceed " + std::to_string(limits.deck_bytes) + " bytes");
  return text;
}

Result<int> Reading::open_file(const std::string& name) {
  const auto known = file_index_.find(name);
  if (known != file_index_.end()) return known->second;
  Result<std::string> text = read_counted(name);
  if (!text) return text.error();
  const int index = add_text(name, std::move(*text));
  file_index_[name] = index;
  return index;
}

namespace {

std::vector<std::size_t> line_starts(const std::string& text) {
  std::vector<std::size_t> starts = {0};
  const char* const begin = text.data();
  const char* const end = begin + text.size();
  for (const char* p = begin; (p = static_cast<const char*>(std::memchr(p, '\n', end - p)));)
    starts.push_back(++p - begin);
  return starts;
}

}  // namespace

int Reading::add_text(std::string name, std::string text) {
  std::vector<std::size_t> starts = line_starts(text);
  files_.push_back(std::make_shared<const DeckFile>(
      DeckFile{std::move(name), std::move(text), std::move(starts)}));
  return file_count() - 1;
}

Result<std::string> Reading::resolve(std::string_view name, int from) const {
  Result<std::string> expanded = expand_environment(name);
  if (!expanded) return expanded;
  std::string path = *expanded;
  const std::string& base = file(from).name;
  const std::size_t slash = base.rfind('/');
  if (slash != std::string::npos && (path.empty() || path[0] != '/'))
    path = base.substr(0, slash + 1) + path;
  std::vector<std::string_view> parts;
  const bool absolute = !path.empty() && path[0] == '/';
  std::string_view rest = path;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('/'), rest.size());
    const std::string_view part = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (part.empty() || part == ".") continue;
    if (part == ".." && !parts.empty() && parts.back() != "..")
      parts.pop_back();
    else
      parts.push_back(part);
  }
  std::string resolved = absolute ? "/" : "";
  for (std::size_t i = 0; i < parts.size(); ++i) resolved += (i ? "/" : "") + std::string(parts[i]);
  return resolved;
}

Result<std::string> Reading::expand_environment(std::string_view name) const {
  std::string r;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '$') {
      r += name[i];
      continue;
    }
    if (char_at(name, i + 1) == '$') {
      r += '$';
      ++i;
      continue;
    }
    const bool braces = char_at(name, i + 1) == '{';
    const std::size_t begin = i + 1 + braces;
    const std::size_t end = skip_identifier(name, begin);
    const auto value = environment.find(name.substr(begin, end - begin));
    if (value == environment.end() || (braces && char_at(name, end) != '}'))
      return make_error(ErrorKind::deck, "",
                        "\"" + std::string(name.substr(begin, end - begin)) +
                            "\" is not set; a deck sees only what its own `setenv` cards set");
    r += value->second;
    i = end - 1 + braces;
  }
  return r;
}

Result<std::string> Reading::read_data(std::string_view name, int from) {
  Result<std::string> path = resolve(name, from);
  if (!path) return path;
  return read_counted(*path);
}

SourceSpan Reading::span(int file, std::size_t offset, std::size_t length) const {
  SourceSpan s;
  if (file < 0 || file >= file_count()) return s;
  const DeckFile& f = this->file(file);
  const auto line = std::upper_bound(f.line_starts.begin(), f.line_starts.end(), offset) - 1;
  s.file = file;
  s.line = static_cast<int>(line - f.line_starts.begin()) + 1;
  s.column = static_cast<int>(offset - *line) + 1;
  s.length = static_cast<int>(length);
  return s;
}

std::size_t Reading::offset_of(SourceSpan where) const {
  if (where.file < 0 || where.line < 1) return 0;
  return file(where.file).line_starts[where.line - 1] + where.column - 1;
}

std::string Reading::place(SourceSpan where) const {
  if (where.file < 0) return "the start";
  return file(where.file).name + ":" + std::to_string(where.line);
}

// --------------------------------------------------------------------------------------------------------
// diagnostics

namespace {

std::string line_of(const DeckFile& f, int line) {
  const std::size_t begin = f.line_starts[line - 1];
  std::size_t end = f.text.find('\n', begin);
  if (end == std::string::npos) end = f.text.size();
  if (end > begin && f.text[end - 1] == '\r') --end;
  constexpr std::size_t longest = 500;
  std::string r = f.text.substr(begin, std::min(end - begin, longest));
  for (char& c : r)
    if (static_cast<unsigned char>(c) < ' ' && c != '\t') c = ' ';
  return r;
}

}  // namespace

Diagnostic Reading::diagnostic(Severity severity, std::string code, SourceSpan where,
                               std::string message, std::string hint) const {
  Diagnostic d;
  d.severity = severity;
  d.code = std::move(code);
  d.message = std::move(message);
  d.hint = std::move(hint);
  if (where.file >= 0) {
    const DeckFile& f = file(where.file);
    d.file = f.name;
    d.line = where.line;
    d.column = where.column;
    d.length = where.length;
    d.source_line = line_of(f, where.line);
  }
  for (int t = trail_; t >= 0; t = trails_[t].parent) {
    const Trail& trail = trails_[t];
    const std::string place = file(trail.file).name + ":" + std::to_string(trail.line);
    d.trail.push_back(trail.loop ? "in iteration " + trail.name + " = " +
                                       std::to_string(trail.value) + " of the loop at " + place
                                 : "included from " + place);
  }
  return d;
}

void Reading::report(Diagnostic d) {
  if (damaged_ || exited || is_known(d) || is_repeated_refusal(d)) return;
  if (d.severity == Severity::error) {
    if (errors_ >= limits.errors) return;
    ++errors_;
  } else if (++warnings_ > kMostWarnings) {
    if (warnings_ > kMostWarnings + 1) return;
    d.message =
        "more than " + std::to_string(kMostWarnings) + " warnings: from here on they are not told";
    d.hint.clear();
  }
  if (d.code.starts_with("limit-")) stopped_ = true;
  diagnostics_.push_back(std::move(d));
}

/// Was the same said about the same place? Passes of loops and repeated includes would repeat it.
bool Reading::is_known(const Diagnostic& d) const {
  return std::any_of(diagnostics_.begin(), diagnostics_.end(), [&](const Diagnostic& other) {
    return other.line == d.line && other.column == d.column && other.severity == d.severity &&
           other.file == d.file && other.message == d.message;
  });
}

/// A card that is not supported is refused once by name; further ones of its kind are counted, so
/// that they do not hide other errors.
bool Reading::is_repeated_refusal(const Diagnostic& d) {
  if (d.code != "not-supported") return false;
  const std::string word = d.message.substr(std::min(d.message.find('"'), d.message.size()));
  const auto [entry, is_new] = refusals_.try_emplace(word, Refusal{diagnostics_.size()});
  if (is_new || errors_ >= limits.errors) return !is_new;
  diagnostics_[entry->second.first].hint =
      std::to_string(++entry->second.repeated) + " more of this kind in the deck";
  return true;
}

void Reading::warn(SourceSpan where, std::string message, std::string hint) {
  report(diagnostic(Severity::warning, "warning", where, std::move(message), std::move(hint)));
}

void Reading::set_expression_place(int file, std::size_t offset) {
  expression_file_ = file;
  expression_offset_ = offset;
}

void Reading::warn_in_expression(std::size_t where, std::size_t length, std::string message) {
  warn(expression_span(where, length), std::move(message));
}

SourceSpan Reading::expression_span(std::size_t where, std::size_t length) const {
  return span(expression_file_, expression_offset_ + where, length);
}

void Reading::fail(SourceSpan where, std::string message, std::string hint,
                   std::string code) const {
  throw DeckError(
      diagnostic(Severity::error, std::move(code), where, std::move(message), std::move(hint)));
}

void Reading::fail_limit(SourceSpan where, std::string_view name, std::string message) const {
  fail(where, std::move(message) + " (limit `" + std::string(name) + "`)", "",
       "limit-" + std::string(name));
}

void Reading::print(SourceSpan where, std::string_view line) {
  if (printed.size() + line.size() > options.printed_bytes)
    fail_limit(where, "printed-bytes",
               "the deck prints more than " + std::to_string(options.printed_bytes) + " bytes");
  printed += line;
}

void Reading::fail_read(SourceSpan where, const Error& error, int from) const {
  if (error.kind == ErrorKind::limit) fail_limit(where, error.reason, error.message);
  std::string message = error.message;
  if (error.kind == ErrorKind::io) {
    const std::string& base = file(from).name;
    const std::size_t slash = base.rfind('/');
    message += slash == std::string::npos ? " (searched in the deck's folder)"
                                          : " (searched in \"" + base.substr(0, slash) + "\")";
  }
  fail(where, std::move(message),
       error.kind == ErrorKind::io
           ? "check the name; it counts from the folder of the file that names it"
           : "",
       "file");
}

int Reading::add_trail(Trail t) {
  trails_.push_back(std::move(t));
  return static_cast<int>(trails_.size()) - 1;
}

void Reading::forget_trail(int trail) {
  if (trail >= kept_trails_) trails_.resize(trail);
}

// --------------------------------------------------------------------------------------------------------------
// model

const EvalContext& Reading::context() {
  return builder_ ? builder_->input_context() : *empty_context_;
}

void Reading::start_run_variables(double initial_time) {
  model_available_ = true;
  const std::pair<const char*, SymbolRole> names[] = {{"Time", SymbolRole::time},
                                                      {"TimeStep", SymbolRole::time_step},
                                                      {"Step", SymbolRole::step},
                                                      {"Var", SymbolRole::var}};
  for (const auto& [name, role] : names) {
    Symbol* s = symbols.find(name);
    if (!s) {
      Symbol made;
      made.name = name;
      made.value = role == SymbolRole::step ? Value(std::int32_t{0}) : Value(0.0);
      s = &symbols.declare(std::move(made));
    } else if (s->constant || type_of(s->value) == ValueType::string) {
      fail(s->where,
           "\"" + s->name +
               "\" is a variable of the run and cannot be a constant or a string of the deck",
           "choose another name", "redefinition");
    }
    s->role = role;
    if (role != SymbolRole::time) continue;
    if (auto* real = std::get_if<double>(&s->value))
      *real = initial_time;
    else if (auto* integer = std::get_if<std::int32_t>(&s->value)) {
      if (!(std::abs(initial_time) <= std::numeric_limits<std::int32_t>::max()))
        fail(s->where, "the initial time does not fit the integer \"Time\"",
             "declare it as `set: real Time = 0.;`", "redefinition");
      *integer = static_cast<std::int32_t>(initial_time);
    }
  }
}

void Reading::add_pending(std::shared_ptr<PendingString> s) {
  pending_.push_back(std::move(s));
  kept_trails_ = static_cast<int>(trails_.size());
}

// --------------------------------------------------------------------------------------------------------------
// random

// Additive feedback generator r(i) = r(i-3) + r(i-31) mod 2^32, value r/2, started by a Lehmer
// generator (16807).
void Reading::seed(std::uint32_t value) {
  std::int64_t x = value ? static_cast<std::int32_t>(value) : 1;
  for (int i = 0; i < 31; ++i) {
    if (i > 0) {
      x = x * 16807 % 2147483647;
      if (x < 0) x += 2147483647;
    }
    random_[i] = static_cast<std::uint32_t>(x);
  }
  random_position_ = 3;
  for (int i = 0; i < 310; ++i) random();
}

std::int32_t Reading::random() {
  // The ring holds the last 31 values; the oldest is at random_position_.
  std::uint32_t& oldest = random_[random_position_];
  const std::uint32_t third = random_[(random_position_ + 28) % 31];
  oldest += third;
  random_position_ = (random_position_ + 1) % 31;
  return static_cast<std::int32_t>(oldest >> 1);
}

}  // namespace mbcosim
