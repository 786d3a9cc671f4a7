/// A run-time string between its card and the end of the deck, and during the run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "input/binder.h"
#include "input/program.h"
#include "input/syntax.h"
#include "model/diagnostic.h"
#include "model/node.h"

namespace mbcosim {

class PendingString {
 public:
  /// Parses; throws DeckError.
  PendingString(Reading& reading, std::string text, SourceSpan where,
                std::vector<std::string> arguments = {});

  /// Binds names for good; false when something is wrong, which was reported then.
  bool bind(Reading& reading);
  /// The reader is gone.
  void detach() { reading_ = nullptr; }
  /// Marks the deck's variables that this string assigns with indices from `*count` on.
  void claim_variables(Reading& reading, int* count);
  bool assigns() const { return assigns_; }
  SourceSpan where() const { return where_; }

  double value(const EvalContext& context, double var) const;
  /// Runs the string and stores what it assigns as this step's values.
  void commit(const EvalContext& context, std::vector<double>* variables) const;
  const Program& program() const { return program_; }
  /// Value and derivatives with respect to the arguments.
  double value(const EvalContext& context, const double* arguments) const;
  double value_and_gradient(const EvalContext& context, const double* arguments,
                            double* gradient) const;
  int arguments() const { return static_cast<int>(arguments_.size()); }
  double slope(const EvalContext& context, double var) const;  ///< ∂value/∂Var
  /// As those of Drive, by way of plugin variables and the like.
  void collect_followed(std::vector<NodeDof>& dofs) const;
  void write_slopes(const EvalContext& context, double factor, double*& next) const;

 private:
  template <class T>
  T evaluate(const EvalContext& context, const T* arguments, const T& var,
             const T* drives = nullptr) const;
  template <class T>
  void write_slopes_as(const EvalContext& context, double factor, double*& next) const;
  template <class T>
  double gradient(const EvalContext& context, const double* arguments, double* gradient) const;
  template <class T>
  T result(const Program& program, const Slot<T>& slot) const;
  void bind_to(Reading& reading, Program* program) const;
  void capture(const Reading& reading);
  [[noreturn]] void fail(Reading& reading, const ExpressionError& e) const;
  [[noreturn]] void fail_run(const ExpressionError& e) const;

  Reading* reading_;
  std::string text_;
  SourceSpan where_;
  std::string place_;  ///< "a.mbd:3:12", for messages during the run
  int trail_ = -1;
  std::vector<std::string> arguments_;
  Syntax syntax_;
  CapturedNames captured_;
  std::map<std::string, double, std::less<>> currents_;
  Program program_;
  bool assigns_ = false;
  std::uint64_t random_key_ = 0;
};

}  // namespace mbcosim
