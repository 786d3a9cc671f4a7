/// What can be wrong, as values: deck diagnostics with their place, and run-time failures with
/// their kind.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace mbcosim {

/// A piece of deck text. `file` indexes the reader's list of files (0: the deck itself); lines and
/// columns count from 1.
struct SourceSpan {
  int file = -1;
  int line = 0;
  int column = 0;
  int length = 0;
};

enum class Severity { error, warning, note };
const char* severity_name(Severity severity);  ///< "error", "warning", "note"

/// One finding about a deck.
struct Diagnostic {
  Severity severity = Severity::error;
  std::string code;  ///< stable identifier, e.g. "unknown-variable", "limit-include-depth"
  std::string file;  ///< name as the user wrote it
  int line = 0, column = 0, length = 0;
  std::string
      message;  ///< names the card, entity and label; says what was found and what is accepted
  std::string source_line;  ///< the offending line of the deck
  std::string hint;         ///< how to mend it; may be empty
  std::vector<std::string>
      trail;  ///< "included from a.mbd:3", "in iteration k = 4 of the loop at b.mbd:7"

  /// `file:line:column: error: message`, the line, a caret, the hint and the trail.
  std::string text() const;
};

enum class ErrorKind {
  deck,           ///< the deck or one of its files is wrong; see `diagnostics`
  argument,       ///< a call's argument is wrong
  precondition,   ///< the call is not allowed in this state
  not_converged,  ///< Newton did not meet its tolerance; see `failure`
  singular,       ///< the matrix cannot be factored; see `failure`
  evaluation,  ///< a drive, law or function could not be evaluated (domain error, division by zero)
  peer,        ///< a coupled peer failed
  limit,       ///< a configured limit was exceeded; its name is in `reason`
  cancelled,   ///< cancelled or past its deadline
  io,          ///< a file could not be read or written
  data_loss,   ///< bytes to import are damaged
  internal,    ///< our mistake
};

/// One of the worst equations of a failed solve.
struct WorstEquation {
  std::string owner;     ///< "joint 7 (revolute hinge)"
  std::string equation;  ///< "constraint 2: position along axis 2"
  double residual = 0;
};

/// What the nonlinear solver knew when it gave up.
struct SolverFailure {
  double time = 0;  ///< [s]
  long step = 0;
  int iteration = 0;
  std::vector<double> residual_history;  ///< test value before each linear solve
  std::vector<WorstEquation> worst;
};

struct Error {
  ErrorKind kind = ErrorKind::internal;
  std::string message;
  std::string reason;  ///< machine-readable identifier, e.g. "NOT_CONVERGED", "LIMIT_INCLUDE_DEPTH"
  std::vector<Diagnostic> diagnostics;
  SolverFailure failure;
};

/// `reason` may be empty.
Error make_error(ErrorKind kind, std::string reason, std::string message);
/// Of work that somebody has stopped.
Error cancelled_error(std::string message);

/// A value or an `Error`.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  explicit operator bool() const { return content_.index() == 0; }
  T& operator*() { return std::get<0>(content_); }
  const T& operator*() const { return std::get<0>(content_); }
  T* operator->() { return &std::get<0>(content_); }
  const T* operator->() const { return &std::get<0>(content_); }
  const Error& error() const { return std::get<1>(content_); }
  Error& error() { return std::get<1>(content_); }

 private:
  std::variant<T, Error> content_;
};

struct Nothing {};
using Status = Result<Nothing>;
inline Status ok() { return Nothing{}; }

/// Thrown by readers below the statement level; the statement loop catches it, records it and goes
/// on at the next `;`.
class DeckError : public std::runtime_error {
 public:
  explicit DeckError(Diagnostic d) : std::runtime_error(d.message), diagnostic(std::move(d)) {}
  Diagnostic diagnostic;
};

/// Thrown when a drive, law or function cannot be evaluated; `Simulation` turns it into an `Error`
/// of kind `evaluation`.
class EvaluationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace mbcosim
