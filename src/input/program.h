/// Expressions of the deck with names bound and types known: each is a flat program for a stack
/// machine.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "input/functions.h"
#include "input/symbols.h"
#include "input/value.h"
#include "model/fwd.h"

namespace mbcosim {

class Reading;

enum class Op : std::uint8_t {
  push,       ///< constant of the instruction's type
  push_text,  ///< Program::texts[index]
  load_symbol,
  store_symbol,  ///< variable of the deck, while the deck is read
  load_local,
  store_local,    ///< variable of the run-time string
  load_argument,  ///< real argument number `index`
  load_variable,  ///< State::variables[index]
  load_time,
  load_time_step,
  load_step,
  load_var,
  load_drive,  ///< value in time of Program::drives[index]
  convert,     ///< the value `depth` below the top, from `from` to `type`
  drop,
  negate_integer,
  negate_real,
  not_integer,
  not_real,
  not_text,
  add_integer,
  subtract_integer,
  multiply_integer,
  divide_integer,
  modulo,
  power_integer,
  add_real,
  subtract_real,
  multiply_real,
  divide_real,
  power_real,
  less,
  less_equal,
  equal,
  greater_equal,
  greater,
  not_equal,  ///< of reals
  logical_and,
  logical_or,
  logical_xor,  ///< of reals
  concatenate,  ///< text + value of type `from`
  call,         ///< `function` with `count` arguments
  format,       ///< sprintf: text, value of type `from`
  drive_value,
  drive_derivative,  ///< label, argument
  function_value,    ///< argument, order: Program::functions[index]
  node_function,     ///< one or two labels: NodeFunction number `index`
  node_datum,
  element_datum,  ///< [label,] text; `index`: kind of node or family
};

/// How a conversion treats what it loses.
enum class Loss : std::uint8_t { silent, warn };

struct Instruction {
  Op op = Op::push;
  ValueType type = ValueType::real;  ///< of the result
  ValueType from = ValueType::real;
  std::uint8_t depth = 0;
  Loss loss = Loss::silent;
  std::uint8_t count = 0;
  FunctionId function = FunctionId::sin;
  std::uint32_t where = 0, length = 0;  ///< place in the text
  union {
    double real = 0;
    std::int32_t integer;  ///< also bool
    std::int32_t index;
    Symbol* symbol;
  };
};

struct Program {
  struct Local {
    ValueType type = ValueType::real;
    double initial = 0;
    int variable =
        -1;  ///< ≥ 0: starts with State::variables[variable] and is written back once a step
  };
  struct Function {
    ScalarFunctionPtr object;
    int evaluations;  ///< of functions, for one value
  };
  std::vector<Instruction> code;
  std::vector<std::string> texts;
  std::vector<DrivePtr> drives;
  std::vector<Function> functions;
  std::vector<Local> locals;
  int depth = 0;  ///< largest number of values on the stack
  ValueType type = ValueType::real;

  void clear();
};

/// One value on the stack: `r` for reals, `i` for booleans and integers; texts are on a stack of
/// their own.
template <class T>
struct Slot {
  T r{};
  std::int32_t i = 0;
};

/// What a program runs with. T: double, or a dual number whose directions are the arguments.
template <class T>
struct Frame {
  const EvalContext* context = nullptr;
  Reading* reading = nullptr;  ///< while the deck is read; null during the run
  const T* arguments = nullptr;
  T var{};                         ///< value of `Var`
  const T* drives = nullptr;       ///< values of Program::drives; null: they are asked
  std::uint64_t random_key = 0;    ///< distinguishes the random numbers of different strings
  std::vector<std::string> texts;  ///< stack of texts; the result, when it is one
  bool keep_locals = false;        ///< wanted: the values of the locals after the run, in `locals`
  std::vector<Slot<T>> locals;
};

/// Runs the program; throws ExpressionError. The result is of type program.type.
template <class T>
Slot<T> run(const Program& program, Frame<T>& frame);

}  // namespace mbcosim
