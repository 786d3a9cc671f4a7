/// Gives names and operators of an expression their meaning: types, variables, functions.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "input/program.h"
#include "input/syntax.h"

namespace mbcosim {

/// A variable of a loop pass, as a run-time string remembers it.
struct Captured {
  Value value;
  DrivePtr plugin;
};
using CapturedNames = std::map<std::string, Captured, std::less<>>;

/// How names are looked up.
struct BindingRules {
  bool run_time = false;  ///< a run-time string; else the expression of a card, evaluated at once
  const CapturedNames* captured = nullptr;
  const std::vector<std::string>* arguments = nullptr;
  std::string_view text;  ///< of the whole expression, for messages
};

/// Throws ExpressionError. Declarations of cards enter the symbol table.
void bind(Reading& reading, const Syntax& syntax, const BindingRules& rules, Program* program);

}  // namespace mbcosim
