/// One reading of a deck: everything that outlives a statement (files, symbols, diagnostics,
/// limits, the model being built).
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "input/sources.h"
#include "input/symbols.h"
#include "model/context.h"
#include "model/deck_file.h"
#include "model/diagnostic.h"
#include "model/fwd.h"
#include "model/limits.h"

namespace mbcosim {

class PendingString;
struct ExpressionScratch;

/// Where a statement comes from, besides its file: an `include` card or a pass of a loop.
struct Trail {
  int parent = -1;
  bool loop = false;
  int file = 0;  ///< of the `include` or `for` card
  int line = 0;
  std::string name;  ///< loop variable
  std::int32_t value = 0;
};

/// What the evaluation of a drive, a law, a function or a dummy node takes.
struct Weight {
  int depth = 0;    ///< longest chain of references behind it
  int objects = 0;  ///< counted as often as they are evaluated
};

template <class T>
struct Named {
  T object;
  SourceSpan where;
  Weight weight{};
};

struct ReaderOptions {
  bool strict = false;    ///< `for` and `if` are unknown cards, absent counts mean 0
  bool redefine = false;  ///< declarations of known variables assign (MBDyn's switch -r)
  std::chrono::milliseconds read_time = std::chrono::minutes(5);  ///< limit `read-time`
  std::size_t printed_bytes = 16 << 20;                           ///< limit `printed-bytes`
  SymbolValues symbols;  ///< instead of the values of the first declarations at outer level
};

class Reading {
 public:
  /// `builder` may be null: a deck used as a calculator.
  Reading(const FileSource& source, Limits limits, ModelBuilder* builder = nullptr,
          ReaderOptions options = {});
  ~Reading();
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  // ------------------------------------------------------------------ files
  const DeckFile& file(int index) const { return *files_[index]; }
  /// All of them, kept at least until reading ends: statements are views into their texts.
  const DeckFiles& files() const { return files_; }
  int file_count() const { return static_cast<int>(files_.size()); }
  /// Reads a file of the deck by its name relative to the root; its index. Counts against
  /// `deck_bytes`.
  Result<int> open_file(const std::string& name);
  /// Adds a text that is no file (tests).
  int add_text(std::string name, std::string text);
  /// Name relative to the root of a file named in file `from`: its folder is put in front, `.` and
  /// `..` are resolved, `$NAME` is replaced by what `setenv` defined.
  Result<std::string> resolve(std::string_view name, int from) const;
  /// Text of a data file named in file `from` (`Card::file_contents`). Counts against `deck_bytes`.
  Result<std::string> read_data(std::string_view name, int from);
  SourceSpan span(int file, std::size_t offset, std::size_t length) const;
  std::size_t offset_of(SourceSpan where) const;  ///< inverse of `span`
  std::string place(SourceSpan where) const;      ///< "a.mbd:3"

  // ------------------------------------------------------------------ diagnostics
  Diagnostic diagnostic(Severity severity, std::string code, SourceSpan where, std::string message,
                        std::string hint = "") const;
  void report(Diagnostic d);
  void warn(SourceSpan where, std::string message, std::string hint = "");
  [[noreturn]] void fail(SourceSpan where, std::string message, std::string hint = "",
                         std::string code = "error") const;
  /// Refuses with code `limit-<name>`; the name stands in the message, too.
  [[noreturn]] void fail_limit(SourceSpan where, std::string_view name, std::string message) const;
  /// Keeps a line that the deck prints; refused when the deck prints too much.
  void print(SourceSpan where, std::string_view line);
  bool out_of_time() const { return std::chrono::steady_clock::now() > read_until_; }
  /// Refuses a file named in file `from` that could not be read.
  [[noreturn]] void fail_read(SourceSpan where, const Error& error, int from) const;
  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }
  std::vector<Diagnostic> release_diagnostics() { return std::move(diagnostics_); }
  int errors() const { return errors_; }
  bool full() const { return errors_ >= limits.errors || stopped_; }  ///< no use in reading on
  void stop() { stopped_ = true; }  ///< after a limit: nothing more is read
  bool stopped() const { return stopped_; }
  /// A warning about a piece of the expression that is being evaluated.
  void warn_in_expression(std::size_t where, std::size_t length, std::string message);
  void set_expression_place(int file, std::size_t offset);
  SourceSpan expression_span(std::size_t where, std::size_t length) const;
  /// Errors of the present statement are consequences of an earlier one and are not reported.
  void set_damaged(bool damaged) { damaged_ = damaged; }
  bool is_damaged() const { return damaged_; }

  int add_trail(Trail t);
  /// Frees the trail and those after it, unless a run-time string was read since then.
  void forget_trail(int trail);
  void set_trail(int trail) { trail_ = trail; }
  int trail() const { return trail_; }

  // ------------------------------------------------------------------ model
  ModelBuilder* builder() const { return builder_; }
  /// Input configuration at the initial time; an empty context without a builder.
  const EvalContext& context();
  /// At the end of the `initial value` block: `Time`, `TimeStep`, `Step`, `Var` and the namespace
  /// `model` exist from here on.
  void start_run_variables(double initial_time);
  bool model_available() const { return model_available_; }

  /// At the end of the deck: binds the names in run-time strings, reports the unknown ones, and
  /// registers what strings assign.
  void bind_strings();
  void add_pending(std::shared_ptr<PendingString> s);

  const Limits limits;
  const ReaderOptions options;
  SymbolTable symbols;
  std::map<std::string, Named<ScalarFunctionPtr>, std::less<>> functions;
  std::map<std::string, double, std::less<>>
      currents;  ///< model::current("L"), set while a card is read
  std::map<std::string, std::string, std::less<>> environment;  ///< what `setenv` defined
  std::string printed;  ///< what `remark`, `print symbol table` and `print()` printed
  bool exited = false;  ///< `exit;` or stop(1, 0): the deck ends here with success

  ExpressionScratch& scratch() {
    return *scratch_;
  }  ///< buffers for evaluating one expression at a time

  std::int32_t random();  ///< next of rand(): 0..2147483647
  void seed(std::uint32_t value);

 private:
  static constexpr int kMostWarnings = 1000;

  Result<std::string> read_counted(const std::string& name);
  bool is_known(const Diagnostic& d) const;
  bool is_repeated_refusal(const Diagnostic& d);
  Result<std::string> expand_environment(std::string_view name) const;

  const FileSource& source_;
  ModelBuilder* builder_;
  DeckFiles files_;
  std::map<std::string, int> file_index_;
  std::int64_t bytes_ = 0;
  const std::chrono::steady_clock::time_point read_until_;
  std::vector<Diagnostic> diagnostics_;
  struct Refusal {
    std::size_t first = 0;  ///< in diagnostics_
    int repeated = 0;
  };
  std::map<std::string, Refusal> refusals_;  ///< by the words of "... is not supported yet"
  int errors_ = 0, warnings_ = 0;
  bool stopped_ = false, damaged_ = false, model_available_ = false;
  int expression_file_ = -1;
  std::size_t expression_offset_ = 0;
  std::deque<Trail> trails_;
  int trail_ = -1;
  std::unique_ptr<EvalContext> empty_context_;
  std::unique_ptr<ExpressionScratch> scratch_;
  std::vector<std::shared_ptr<PendingString>> pending_;
  int kept_trails_ = 0;  // trails that pending strings may refer to
  std::uint32_t random_[31] = {};
  int random_position_ = 0;
};

}  // namespace mbcosim
