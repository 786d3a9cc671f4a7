/// What a model consists of: nodes, elements, drives, frames and variables, for people and for
/// programs.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/model.h"
#include "model/symbol.h"
#include "simulation/variable.h"

namespace mbcosim {

struct NodeDescription {
  std::string type;  ///< "structural", "abstract", ...
  std::string kind;  ///< "dynamic", "differential", ...
  int label = 0;
  std::string name;
  std::vector<double> value;      ///< input position, global [m] (3), or the initial value (1)
  std::vector<std::string> data;  ///< names of private data
  int unknowns = 0;
};

struct ElementDescription {
  std::string family;  ///< "joint"
  std::string type;    ///< "revolute hinge"
  int label = 0;
  std::string name;
  std::vector<int> nodes;         ///< labels of structural nodes
  std::vector<std::string> data;  ///< names of private data
  int unknowns = 0;
  bool driven = false;
};

struct DriveDescription {
  int label = 0;
  std::string name;
  bool has_derivative = false;
};

struct ModelDescription {
  std::string title;
  std::string digest;                                      ///< 16 hexadecimal digits
  double initial_time = 0, final_time = 0, time_step = 0;  ///< [time_unit]
  std::string time_unit = "s";                             ///< as the deck declares it
  int unknowns = 0;
  std::vector<NodeDescription> nodes;
  std::vector<ElementDescription> elements;
  std::vector<DriveDescription> drives;
  std::vector<int> frames;          ///< labels of reference frames
  std::vector<DeckSymbol> symbols;  ///< of `set` cards
  std::vector<Variable> variables;  ///< what can be read and written, in the units of the deck
};

/// `variables` of a simulation of the model, `symbols` of its deck; may be left out.
ModelDescription describe(const Model& model, std::vector<Variable> variables = {},
                          std::vector<DeckSymbol> symbols = {});
/// A tree of lines with two blanks per level: variables stand below what they belong to.
std::string to_text(const ModelDescription& description);
/// One JSON object; infinite numbers are null, what is not UTF-8 is replaced.
std::string to_json(const ModelDescription& description);

const char* causality_name(Causality causality);

}  // namespace mbcosim
