/// What clients learn of a model: nodes, elements, variables, symbols and ports.
#pragma once

#include <memory>
#include <vector>

#include "coupling/port.h"
#include "mbcosim/v1/simulations.pb.h"
#include "model/symbol.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// All that there is to describe.
struct Described {
  const Model& model;
  const std::vector<Variable>& variables;
  const std::vector<DeckSymbol>& symbols;
  const std::vector<std::unique_ptr<Port>>& ports;
};

/// A page of it, or the variables that the request names. Throws BAD_ARGUMENT, NO_SUCH_VARIABLE.
void describe(const Described& described, const v1::DescribeSimulationRequest& request,
              v1::DescribeSimulationReply* reply);

}  // namespace mbcosim::server
