/// Which optional members an element type has.
#pragma once

#include <string_view>

#include "elements/element_view.h"

namespace mbcosim::detail {

template <class E>
concept HasTangent = requires(const E& e, const Local<double>& u, Tangent& t) {
  e.tangent(u, t);
};
template <class E>
concept HasStart = requires(const E& e, Start& s) {
  e.start(s);
};
template <class E>
concept HasAtDerivatives = requires(const E& e, const Local<double>& u, State& s) {
  e.at_derivatives(u, s, true);
};
template <class E>
concept HasAfterPredict = requires(const E& e, const Local<double>& u, State& s) {
  e.after_predict(u, s);
};
template <class E>
concept HasStagesApart = requires(const E& e) {
  e.stages_apart();
};
template <class E>
concept HasAccumulate = requires(const E& e, const Local<double>& u, Sums& s) {
  e.accumulate(u, s);
};
template <class E>
concept HasAfterConvergence = requires(const E& e, const Local<double>& u, State& s) {
  e.after_convergence(u, s);
};
template <class E>
concept HasOutput = requires(const E& e, const Local<double>& u, OutputRow& r) {
  e.output(u, r);
};
template <class E>
concept HasLog = requires(const E& e, const Model& m) {
  e.log(m, 0);
};
template <class E>
concept HasPrivateData = requires(const E& e, const Local<double>& u) {
  e.private_datum(std::string_view());
  e.private_value(u, 0);
};
template <class E>
concept HasPrivateNames = requires(const E& e) {
  e.private_data();
};
template <class E>
concept HasRowName = requires(const E& e) {
  e.row_name(0);
};
template <class E>
concept HasInertia = requires(const E& e, const Local<double>& u, Inertia& i) {
  e.add_inertia(u, 0, i);
};
template <class E>
concept HasAssemblyResidual = requires(const E& e, const Local<TimeDual>& u,
                                       Residual<TimeDual>& r) {
  e.assembly_residual(u, r);
};
template <class E>
concept HasAssemblyRole = requires(const E& e) {
  e.assembly_role();
};
template <class E>
concept ConstrainsVelocity = requires(const E& e) {
  e.constrains_velocity(0);
};
template <class E>
concept HasAssembly = requires {
  E::assembly;
};
template <class E>
concept HasMovableParts = requires {
  E::template movable_parts<E>();
};
template <class E>
constexpr bool uses_momentum() {
  return requires { requires E::momentum_rows; };
}
template <class E>
constexpr bool uses_parameters() {
  return requires { requires E::rotation_parameters; };
}
template <class E>
constexpr bool has_constant_structure() {
  return requires { requires E::constant_structure; };
}
template <class E>
constexpr bool follows_drives() {
  return requires { requires E::follows_drives; };
}

}  // namespace mbcosim::detail
