/// Conformance of element types: what holds for every element, checked on a tiny model in generic
/// states.
///
/// A family joins with one case per type:
///
///     struct SphericalHingeCase {
///       using Element = SphericalHinge;
///       static constexpr bool ideal = true;     // multiplier columns = transposed constraint rows
///       static constexpr bool balanced = true;  // loads of both nodes are in balance
///       static Element make(Bench& bench);      // its constraints hold in the bench's state
///     };
///     MBCOSIM_CONFORMANCE(Joints, testing::Types<SphericalHingeCase, …>);
///
/// Each case gets the tests of the properties that its element has, no others.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "elements/element.h"
#include "jacobian_check.h"

namespace mbcosim::conformance {

/// Two static nodes in generic position, one element under test, and states around the input
/// configuration.
class Bench {
 public:
  static constexpr double kC = 3.7e-3;  ///< the integrator's coefficient

  Bench() {
    first = add_node(StructuralKind::static_);
    second = add_node(StructuralKind::static_);
  }
  int add_node(StructuralKind kind) {
    StructuralNode node;
    node.label = static_cast<int>(builder.model().structural.size()) + 1;
    node.kind = kind;
    node.x = vec();
    if (kind != StructuralKind::static_displacement &&
        kind != StructuralKind::dynamic_displacement) {
      node.R = rotation();
      node.w = vec();
    }
    node.v = vec();
    return builder.add_structural(node);
  }
  const StructuralNode& node(int index) const {
    return (model ? *model : builder.model()).structural[index];
  }
  /// Offset of a global point and relative orientation of a global frame, in the input
  /// configuration.
  Vec3 offset(int index, const Vec3& point) const {
    return node(index).R.transpose() * (point - node(index).x);
  }
  Mat3 relative(int index, const Mat3& R) const { return node(index).R.transpose() * R; }

  Vec3 vec() { return Vec3(number(), number(), number()); }
  Mat3 rotation() { return rotation_of_vector<double>(vec()); }
  double number() { return uniform_(random_); }

  template <class E>
  ElementSetOf<E>& add(E element) {
    ElementInfo info;
    info.label = 1;
    add_element(builder, info, std::move(element));
    return builder.set<ElementSetOf<E>>();
  }
  void finish() {
    auto result = builder.finish();
    ASSERT_TRUE(static_cast<bool>(result));
    model = *result;
    n = model->unknowns;
    state.memory = model->initial_memory;
    state.variables = model->initial_variables;
    state.y.assign(n, 0);
    state.yp.assign(n, 0);
    state.rotation.resize(model->structural.size());
    state.rotation_history.resize(model->structural.size());
    state.time = 0.7;
    state.h = 1e-2;
    input_state();
    const EvalContext at = context(state);
    for (const auto& set : model->sets)
      for (int i = 0; i < set->size(); ++i) set->start(at, state, i);
  }
  /// Nodes at their input configuration (g = 0), generic multipliers.
  void input_state() {
    for (int i = 0; i < n; ++i) {
      state.y[i] = number();
      state.yp[i] = number();
    }
    for (std::size_t k = 0; k < model->structural.size(); ++k) {
      const StructuralNode& s = model->structural[k];
      for (int i = 0; i < 3; ++i) {
        state.y[s.first + i] = s.x(i);
        state.yp[s.first + i] = s.v(i);
        if (!s.has_rotation()) continue;
        state.y[s.first + 3 + i] = 0;
        state.yp[s.first + 3 + i] = 0;
      }
      state.rotation_history[k].R_ref = s.R;
      state.rotation_history[k].w_ref = s.w;
    }
    update(state);
  }
  /// A generic state: everything moved away from the input configuration by up to `size`.
  void generic_state(double size) {
    input_state();
    for (const StructuralNode& s : model->structural)
      for (int i = 0; i < s.position_unknowns(); ++i) {
        state.y[s.first + i] += size * number();
        state.yp[s.first + i] += number();
      }
    update(state);
  }
  /// All nodes at rest where they are.
  void stop() {
    for (std::size_t k = 0; k < model->structural.size(); ++k) {
      const StructuralNode& s = model->structural[k];
      for (int i = 0; i < s.position_unknowns(); ++i) state.yp[s.first + i] = 0;
      state.rotation_history[k].w_ref.setZero();
    }
    update(state);
  }
  /// R and w of all nodes from their rotation parameters.
  void update(State& s) const {
    for (std::size_t k = 0; k < model->structural.size(); ++k) {
      const StructuralNode& node = model->structural[k];
      if (!node.has_rotation()) continue;
      NodeRotation& r = s.rotation[k];
      const NodeRotationHistory& past = s.rotation_history[k];
      const Vec3 g(&s.y[node.first + 3]), gp(&s.yp[node.first + 3]);
      r.R = cgr_rotation(g) * past.R_ref;
      r.w = cgr_g(g) * gp + cgr_rotation(g) * past.w_ref;
    }
  }
  std::vector<NodeSeeds> seeds() const {
    using D = Dual<3>;
    std::vector<NodeSeeds> all(model->structural.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      const StructuralNode& node = model->structural[k];
      all[k].A.setZero();
      all[k].B.setZero();
      if (!node.has_rotation()) continue;
      Vec<D> g, gp;
      for (int i = 0; i < 3; ++i) {
        g(i) = D::variable(state.y[node.first + 3 + i], i, kC);
        gp(i) = D::variable(state.yp[node.first + 3 + i], i, 1);
      }
      const Vec<D> w = cgr_g(g) * gp + cgr_rotation(g) * state.rotation_history[k].w_ref.cast<D>();
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) all[k].B(i, j) = w(i).d[j];
      all[k].A = kC * cgr_g(value_of(g));
    }
    return all;
  }
  EvalContext context(const State& s) const {
    EvalContext c;
    c.model = model.get();
    c.state = &s;
    c.time = s.time;
    c.h = s.h;
    c.c = c.seed = kC;
    c.c_algebraic = 1;
    c.follows = true;
    return c;
  }
  VecX residual(const State& s) const {
    VecX r = VecX::Zero(n);
    const EvalContext c = context(s);
    for (const auto& set : model->sets) set->residual(c, r.data(), set->all());
    return r;
  }
  /// −∂r/∂δ as the elements give it, dense.
  MatX jacobian() const { return matrix_of_elements(context(state), seeds()); }
  /// −∂r/∂δ by central differences on the manifold.
  MatX numerical_jacobian() const {
    const auto step_of = [&](int j) {
      const bool differential = model->kinds[j] == UnknownKind::differential;
      return differential ? 1e-4 : 1e-4 * std::max(1.0, std::abs(state.y[j]));
    };
    return central_differences(n, step_of, [&](int j, double e) { return residual(moved(j, e)); });
  }
  std::string entry_name(int row, int column) const {
    const auto [owner, meaning] = model->row_text(row);
    return "row " + std::to_string(row) + " (" + owner + ", " + meaning + "), column " +
           std::to_string(column);
  }
  /// Own rows and unknowns of the element under test.
  int first_own() const { return model->elements[0].set->first_own(0); }
  int own_count() const { return model->elements[0].set->unknowns(0); }

  ModelBuilder builder;
  ModelPtr model;
  State state;
  int n = 0;
  int first = 0, second = 0;  ///< the nodes

 private:
  State moved(int column, double delta) const {
    State s = state;
    if (model->kinds[column] == UnknownKind::differential) {
      s.y[column] += kC * delta;
      s.yp[column] += delta;
    } else {
      s.y[column] += delta;
    }
    update(s);
    return s;
  }
  std::mt19937 random_{20240607};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

/// Attachments of both nodes to the same generic point and frame.
template <class E>
void attach(Bench& bench, E& e) {
  const Vec3 point = bench.vec();
  const Mat3 frame = bench.rotation();
  e.a = {bench.first, bench.offset(bench.first, point), bench.relative(bench.first, frame)};
  e.b = {bench.second, bench.offset(bench.second, point), bench.relative(bench.second, frame)};
}

inline void expect_near(const Bench& bench, const MatX& a, const MatX& b, double tolerance) {
  const double scale = std::max(1.0, b.cwiseAbs().maxCoeff());
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j) {
      const double error = std::abs(a(i, j) - b(i, j));
      EXPECT_LE(error, tolerance * std::max(std::abs(b(i, j)), 1e-2 * scale))
          << bench.entry_name(i, j) << ": " << a(i, j) << " against " << b(i, j);
    }
}

template <class Case>
class ElementConformance : public testing::Test {
 protected:
  using Element = typename Case::Element;
  void SetUp() override {
    set_ = &bench_.add(Case::make(bench_));
    bench_.finish();
  }
  Bench bench_;
  ElementSetOf<Element>* set_ = nullptr;
};
template <class Case>
class JacobianMatchesCentralDifferences : public ElementConformance<Case> {
  void TestBody() override;
};
template <class Case>
void JacobianMatchesCentralDifferences<Case>::TestBody() {
  Bench& bench = this->bench_;
  for (int k = 0; k < 3; ++k) {
    bench.generic_state(0.3);
    const MatX J = bench.jacobian();
    EXPECT_GT(J.norm(), 1e-3);
    expect_near(bench, J, bench.numerical_jacobian(), 1e-7);
  }
}

template <class Case>
class ClosedFormMatchesDual : public ElementConformance<Case> {
  void TestBody() override;
};
template <class Case>
void ClosedFormMatchesDual<Case>::TestBody() {
  Bench& bench = this->bench_;
  for (int k = 0; k < 5; ++k) {
    bench.generic_state(0.3);
    const EvalContext context = bench.context(bench.state);
    const auto& slot = this->set_->slot(0);
    Local<double> u;
    this->set_->gather(context, slot, u);
    const std::vector<NodeSeeds> seeds = bench.seeds();
    MatX closed = MatX::Zero(slot.row_count, slot.column_count), dual = closed;
    this->set_->closed_form(context, slot, u, seeds.data(), closed.data());
    this->set_->dual_jacobian(slot, u, seeds.data(), dual.data());
    const double scale = std::max(1.0, dual.cwiseAbs().maxCoeff());
    for (int i = 0; i < dual.rows(); ++i)
      for (int j = 0; j < dual.cols(); ++j)
        EXPECT_NEAR(closed(i, j), dual(i, j), 1e-11 * scale)
            << "local row " << i << ", column " << j;
  }
}

/// Each multiplier's column of loads is a multiple of its constraint's row where the constraints
/// are satisfied and the nodes are at rest (velocity constraints rotate with their nodes).
template <class Case>
class IdealJointDoesNoWork : public ElementConformance<Case> {
  void TestBody() override;
};
template <class Case>
void IdealJointDoesNoWork<Case>::TestBody() {
  Bench& bench = this->bench_;
  bench.input_state();
  bench.stop();
  const MatX J = bench.jacobian();
  const int own = bench.first_own(), count = bench.own_count();
  for (int k = 0; k < count; ++k) {
    const VecX load = J.col(own + k).head(own), row = J.row(own + k).head(own).transpose();
    EXPECT_GT(row.norm(), 1e-6) << "constraint " << k;
    EXPECT_NEAR(std::abs(load.dot(row)), load.norm() * row.norm(), 1e-9 * load.norm() * row.norm())
        << "constraint " << k;
  }
}

template <class Case>
class LoadsAreInBalance : public ElementConformance<Case> {
  void TestBody() override;
};
template <class Case>
void LoadsAreInBalance<Case>::TestBody() {
  Bench& bench = this->bench_;
  bench.input_state();
  const VecX r = bench.residual(bench.state);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  double size = 0;
  for (const StructuralNode& node : bench.model->structural) {
    const Vec3 f(r.data() + node.equilibrium);
    const Vec3 m = node.has_rotation() ? Vec3(r.data() + node.equilibrium + 3) : Vec3::Zero();
    const Vec3 x(&bench.state.y[node.first]);
    force += f;
    moment += m + x.cross(f);
    size += f.norm() + m.norm();
  }
  EXPECT_GT(size, 1e-6);
  EXPECT_LT(force.norm(), 1e-12 * size);
  EXPECT_LT(moment.norm(), 1e-12 * size);
}

/// In the initial assembly the rate rows of a holonomic joint are the time derivatives of its
/// position rows.
template <class Case>
class AssemblyRatesAreTimeDerivatives : public ElementConformance<Case> {
  void TestBody() override;
};
template <class Case>
void AssemblyRatesAreTimeDerivatives<Case>::TestBody() {
  Bench& bench = this->bench_;
  ASSERT_EQ(this->set_->assembly_role(0), AssemblyRole::holonomic);
  bench.generic_state(0.3);
  const auto rows = [&](double dt, VecX& rate) {
    State s = bench.state;
    for (std::size_t k = 0; k < s.rotation.size(); ++k) {
      const int first = bench.model->structural[k].first;
      for (int i = 0; i < 3; ++i) s.y[first + i] += dt * s.yp[first + i];
      s.rotation[k].R = rotation_of_vector<double>(dt * s.rotation[k].w) * s.rotation[k].R;
    }
    for (int i = bench.first_own(); i < bench.n; ++i) s.y[i] += dt * s.yp[i];
    EvalContext c = bench.context(s);
    c.c = c.seed = 1;
    c.phase = Phase::assembly;
    VecX r = VecX::Zero(bench.n);
    rate = VecX::Zero(bench.n);
    this->set_->assembly_residual(c, 0, r.data(), rate.data());
    return r;
  };
  VecX rate, unused;
  rows(0, rate);
  constexpr double kStep = 1e-5;
  const VecX difference = (rows(kStep, unused) - rows(-kStep, unused)) / (2 * kStep);
  for (int i = 0; i < bench.n; ++i)
    EXPECT_NEAR(rate(i), difference(i), 1e-8 * std::max(1.0, rate.norm())) << "row " << i;
}

/// Is the element a position constraint whose assembly rows follow from its residual?
template <class Element>
constexpr bool holonomic() {
  if constexpr (detail::HasAssemblyResidual<Element>)
    return false;
  else if constexpr (detail::HasAssembly<Element>)
    return Element::assembly == AssemblyRole::holonomic;
  else
    return false;
}

template <class Test, class Case>
void add_test(const std::string& suite, const char* name) {
  testing::RegisterTest(suite.c_str(), name, nullptr, nullptr, __FILE__, __LINE__,
                        []() -> ElementConformance<Case>* { return new Test; });
}

template <class Case>
void add_case(const std::string& suite) {
  using Element = typename Case::Element;
  add_test<JacobianMatchesCentralDifferences<Case>, Case>(suite,
                                                          "JacobianMatchesCentralDifferences");
  if constexpr (detail::HasTangent<Element>)
    add_test<ClosedFormMatchesDual<Case>, Case>(suite, "ClosedFormMatchesDual");
  if constexpr (Case::ideal)
    add_test<IdealJointDoesNoWork<Case>, Case>(suite, "IdealJointDoesNoWork");
  if constexpr (Case::balanced) add_test<LoadsAreInBalance<Case>, Case>(suite, "LoadsAreInBalance");
  if constexpr (holonomic<Element>())
    add_test<AssemblyRatesAreTimeDerivatives<Case>, Case>(suite, "AssemblyRatesAreTimeDerivatives");
}

template <class... Cases>
bool add_cases(const std::string& name, testing::Types<Cases...>) {
  int index = 0;
  (add_case<Cases>(name + "/ElementConformance/" + std::to_string(index++)), ...);
  return true;
}

#define MBCOSIM_CONFORMANCE(name, cases) \
  [[maybe_unused]] const bool added_##name = ::mbcosim::conformance::add_cases(#name, cases{})

}  // namespace mbcosim::conformance
