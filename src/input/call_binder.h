/// Binds calls: built-in functions and those of the namespace `model`.
#pragma once

#include <string>
#include <string_view>

#include "input/emitter.h"

namespace mbcosim {

class CallBinder : protected Emitter {
 protected:
  using Emitter::Emitter;

  void call(const SyntaxItem& item);
  /// Refuses a namespace that does not exist, and variables of the namespace `model`.
  void check_space(const SyntaxItem& item, bool is_function) const;
  /// "; did you mean …?"
  static std::string nearest_text(std::string_view name, const std::string& best);

 private:
  [[noreturn]] void fail_unknown_function(const SyntaxItem& item, const std::string& best) const;
  void check_count(const SyntaxItem& item, std::string_view name, int least, int most) const;
  /// Argument k of `count` as the function wants it: R, I or S.
  void convert_argument(std::string_view name, int k, int count, char kind);
  void call_format();
  void call_conversion(ValueType to);
  // model::
  void model_call(const SyntaxItem& item);
  Instruction& reduce_model(int count, Op op);
  void call_drive(const SyntaxItem& item);
  void call_current(const SyntaxItem& item);
  void call_scalar_function(const SyntaxItem& item, std::string_view name);
  void call_node_datum(const SyntaxItem& item, std::string_view name);
  void call_element_datum(const SyntaxItem& item, std::string_view name);
  void call_datum(const SyntaxItem& item, Op op, int index);
  /// Label and datum known: looked up once.
  bool bind_datum(int count, Op op, int index);
};

}  // namespace mbcosim
