/// Elements: a small struct of parameters with one templated residual, of which a set is made.
///
///     struct SphericalHinge {
///       int first, second;                     // structural node indices
///       Vec3 p, q;                             // in the node frames [m]
///       static constexpr int width = 15;       // local columns: 6 per node + scalar dofs + own
///       static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
///       void connect(Connector& c) { c.node(first); c.node(second); c.algebraic(3); }
///       template <class T> void residual(const Local<T>& u, Residual<T>& r) const {
///         const Vec<T> arm1 = u.R(0) * p, arm2 = u.R(1) * q;  // nodes by order of connection
///         const Vec<T> lambda = u.own3(0);
///         r.load(0, -lambda, -arm1.cross(lambda));  // force [N], moment about the node [N·m]
///         r.load(1, lambda, arm2.cross(lambda));
///         r.own3(0, (u.x(0) + arm1 - u.x(1) - arm2) / u.c());
///       }
///     };
///
/// T is double (residual), Dual<n> (Jacobian) or TimeDual (initial assembly: value and time
/// derivative). Optional members, found by name:
///
///     void tangent(const Local<double>&, Tangent&) const       −∂r/∂δ in closed form
///     void start(Start&) const                                 initial own unknowns and memory
///     void at_derivatives(const Local<double>&, State&, bool first) const   before the first and
///     the
///         second residual of the derivatives phase
///     void after_predict(const Local<double>&, State&) const   once a step, after the prediction
///     void accumulate(const Local<double>&, Sums&) const       before each residual and matrix:
///         adds to what elements of other families sum up; tangents leave out that sums change
///     void after_convergence(const Local<double>&, State&) const
///     bool stages_apart() const                                after_predict and after_convergence
///         touch nothing but the element's nodes and memory: threads may share such elements
///     void output(const Local<double>&, OutputRow&) const      its lines: begin(…, u.label())
///     std::string log(const Model&, int label) const           its line of the .log file
///     int private_datum(std::string_view) const, std::vector<Datum> private_data() const
///     double private_value(const Local<double>&, int) const
///     bool constrains_velocity(int k) const                    own row k, a velocity alone
///     std::string row_name(int k) const                        meaning of own row k
///     void add_inertia(const Local<double>&, int node, Inertia&) const
///     static constexpr bool momentum_rows = true               has r.momentum(k, …): rows 1–6
///     static constexpr bool rotation_parameters = true         u.g(k), u.gp(k) are gathered
///     static constexpr bool follows_drives = true        calls Connector::drives though it has a
///         tangent: where they follow the state the matrix is that of `residual`
///     static constexpr bool constant_structure = true          entries of its matrix that vanish
///         at one state vanish at all: no branch depends on the state or on a drive
///     template <class E> static constexpr std::array<MovablePart<E>, n> movable_parts()   what
///         hints of `driven` fit to the configuration; E is the type that has them
///     void assembly_residual(const Local<T>&, Residual<T>&) const   replaces it in the assembly
///     AssemblyRole assembly_role() const                       when it depends on the element
#pragma once

#include "elements/element_set_of.h"
#include "elements/element_view.h"
