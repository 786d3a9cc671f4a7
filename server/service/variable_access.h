/// Reading and writing a simulation's variables as clients ask: by handles, checked first.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mbcosim/v1/simulations.pb.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// Knows the variables, not the simulation: that is locked by the caller. Methods throw Refusal.
class VariableAccess {
 public:
  explicit VariableAccess(const std::vector<Variable>& variables) : variables_(variables) {}

  const std::vector<Variable>& variables() const { return variables_; }
  /// Throws NO_SUCH_VARIABLE.
  void check(int handle) const;
  void check(const google::protobuf::RepeatedField<int>& handles) const {
    for (const int handle : handles) check(handle);
  }
  /// Memory of a message with their values: here, in the message, as its bytes, and room to grow.
  /// Throws NO_SUCH_VARIABLE.
  std::int64_t bytes_of(const google::protobuf::RepeatedField<int>& handles) const;
  static constexpr std::int64_t kBytesOfValue = 4 * sizeof(double);
  /// Throws NO_SUCH_VARIABLE, NOT_WRITABLE or BAD_ARGUMENT, which names the request's `field`.
  void check_inputs(const v1::Values& inputs, const std::string& field) const;
  /// Throws BAD_ARGUMENT when the condition makes no sense.
  void check_condition(const v1::Condition& condition) const;

  /// Sets inputs that `check_inputs` has accepted.
  void write(const v1::Values& inputs, Simulation& simulation) const;
  void read(const Simulation& simulation, const google::protobuf::RepeatedField<int>& handles,
            google::protobuf::RepeatedField<double>* out) const;
  bool holds(const v1::Condition& condition, const Simulation& simulation) const;
  /// How far the condition is behind, in the variable's unit: not negative where it holds.
  double distance_behind(const v1::Condition& condition, const Simulation& simulation) const;

 private:
  const std::vector<Variable>& variables_;
};

}  // namespace mbcosim::server
