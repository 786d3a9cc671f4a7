#include "elements/genels/linear_system.h"

#include <limits>

#include "elements/genels/pencil_scaling.h"

namespace mbcosim {

namespace {

/// Power of 2 that brings a column of norm c and a row of norm r together.
double balancing_factor(double c, double r, double c_max, double r_max) {
  constexpr double kLarge = 1 / std::numeric_limits<double>::min() / 2;
  double f = 1;
  while (c < r / 2 && std::max({f, c, c_max}) < kLarge) {
    f *= 2, c *= 2, c_max *= 2;
    r /= 2, r_max /= 2;
  }
  while (c / 2 >= r && std::max(r, r_max) < kLarge) {
    f /= 2, c /= 2, c_max /= 2;
    r *= 2, r_max *= 2;
  }
  return f;
}

void balance_matrix(LinearSystem& s) {
  const int n = s.order();
  constexpr double kWorthwhile = 0.95;
  constexpr int kMostSweeps = 100;
  bool changed = true;
  for (int sweep = 0; changed && sweep < kMostSweeps; ++sweep) {
    changed = false;
    for (int i = 0; i < n; ++i) {
      const double c = s.A.col(i).norm(), r = s.A.row(i).norm();
      if (c == 0 || r == 0) continue;
      const double f = balancing_factor(c, r, s.A.col(i).cwiseAbs().maxCoeff(),
                                        s.A.row(i).cwiseAbs().maxCoeff());
      if (c * f + r / f >= kWorthwhile * (c + r)) continue;
      changed = true;
      s.A.row(i) /= f;
      s.A.col(i) *= f;
      s.B.row(i) /= f;
      s.C.col(i) *= f;
    }
  }
}

void balance_pencil(LinearSystem& s) {
  const PencilScales scales = scale_pencil(s.A, s.E);
  const auto rows = scales.rows.asDiagonal(), columns = scales.columns.asDiagonal();
  s.A = (rows * s.A * columns).eval();
  s.E = (rows * s.E * columns).eval();
  s.B = (rows * s.B).eval();
  s.C = (s.C * columns).eval();
}

}  // namespace

void balance(LinearSystem& s) { s.E.size() == 0 ? balance_matrix(s) : balance_pencil(s); }

LinearSystem companion_system(CanonicalForm form, const std::vector<double>& denominator,
                              const std::vector<double>& numerator) {
  const int n = static_cast<int>(denominator.size()), m = static_cast<int>(numerator.size()) - 1;
  VecX d = VecX::Map(denominator.data(), n), rest = VecX::Zero(n);
  double direct = 0;
  if (m == n) {
    direct = numerator[0];
    for (int k = 0; k < n; ++k) rest(k) = numerator[k + 1] - direct * d(k);
  } else {
    for (int k = 0; k <= m; ++k) rest(n - 1 - m + k) = numerator[k];
  }
  LinearSystem s;
  s.A = MatX::Zero(n, n);
  s.B = MatX::Zero(n, 1);
  s.C = MatX::Zero(1, n);
  if (form == CanonicalForm::controllable) {
    s.A.row(0) = -d.transpose();
    for (int k = 1; k < n; ++k) s.A(k, k - 1) = 1;
    s.B(0, 0) = 1;
    s.C = rest.transpose();
  } else {
    s.A.col(0) = -d;
    for (int k = 1; k < n; ++k) s.A(k - 1, k) = 1;
    s.B = rest;
    s.C(0, 0) = 1;
  }
  if (direct != 0) s.D = MatX::Constant(1, 1, direct);
  return s;
}

void LinearSystemElement::connect(GeneralConnection& c) {
  for (const NodeDof& dof : outputs_) output_.push_back(c.dof(dof));
  for (const ScalarValue& value : inputs_) {
    input_.push_back(value.drive ? -1 : c.dof(value.dof));
    if (value.drive) c.drive(value.drive);
  }
  first_state_ = c.differential(system_.order());
}

double LinearSystemElement::input(const GeneralView& u, int k) const {
  return inputs_[k].drive ? u.drive(inputs_[k].drive) : u.dof(inputs_[k].dof);
}

void LinearSystemElement::residual(const GeneralView& u, GeneralResidual& r) const {
  const int n = system_.order();
  for (int i = 0; i < n; ++i) {
    double sum = 0;
    for (int j = 0; j < n; ++j) {
      sum += system_.A(i, j) * u.value(first_state_ + j);
      if (system_.E.size() != 0) sum -= system_.E(i, j) * u.rate(first_state_ + j);
    }
    if (system_.E.size() == 0) sum -= u.rate(first_state_ + i);
    r.add(first_state_ + i, sum);
  }
  for (int i = 0; i < system_.outputs(); ++i) {
    double sum = -u.dof(outputs_[i]);
    for (int j = 0; j < n; ++j) sum += system_.C(i, j) * u.value(first_state_ + j);
    r.add(output_[i], sum);
  }
  for (int k = 0; k < system_.inputs(); ++k) {
    const double value = input(u, k);
    for (int i = 0; i < n; ++i) r.add(first_state_ + i, system_.B(i, k) * value);
    for (int i = 0; system_.D.size() != 0 && i < system_.outputs(); ++i)
      r.add(output_[i], system_.D(i, k) * value);
  }
}

void LinearSystemElement::jacobian(const GeneralView&, GeneralJacobian& jacobian) const {
  const int n = system_.order();
  for (int j = 0; j < n; ++j) {
    const int column = first_state_ + j;
    for (int i = 0; i < n; ++i) {
      jacobian.value(first_state_ + i, column, system_.A(i, j));
      if (system_.E.size() != 0) jacobian.rate(first_state_ + i, column, -system_.E(i, j));
    }
    if (system_.E.size() == 0) jacobian.rate(column, column, -1.0);
    for (int i = 0; i < system_.outputs(); ++i) jacobian.value(output_[i], column, system_.C(i, j));
  }
  for (int i = 0; i < system_.outputs(); ++i)
    jacobian.dof(output_[i], output_[i], outputs_[i], -1.0);
  for (int k = 0; k < system_.inputs(); ++k) {
    const auto add = [&](int column, const NodeDof& dof, double slope) {
      for (int i = 0; i < n; ++i)
        jacobian.dof(first_state_ + i, column, dof, system_.B(i, k) * slope);
      for (int i = 0; system_.D.size() != 0 && i < system_.outputs(); ++i)
        jacobian.dof(output_[i], column, dof, system_.D(i, k) * slope);
    };
    if (inputs_[k].drive)
      jacobian.each_followed(inputs_[k].drive, add);
    else
      add(input_[k], inputs_[k].dof, 1);
  }
}

void LinearSystemElement::start(const GeneralView& u, State& state) const {
  for (int i = 0; i < system_.order(); ++i) {
    const int k = u.unknown(first_state_ + i);
    if (x0_.size() != 0) state.y[k] = x0_(i);
    if (xp0_.size() != 0) state.yp[k] = xp0_(i);
  }
  if (system_.E.size() != 0) return;
  // Without E the rates follow from the start values, so that the outputs start with consistent
  // rates, too.
  VecX input_values(system_.inputs());
  for (int j = 0; j < system_.inputs(); ++j) input_values(j) = input(u, j);
  VecX rate = system_.B * input_values;
  if (x0_.size() != 0) rate += system_.A * x0_;
  for (int i = 0; i < system_.order(); ++i) state.yp[u.unknown(first_state_ + i)] = rate(i);
}

void LinearSystemElement::output(const GeneralView& u, OutputRow& row) const {
  row.begin(OutputFile::gen, u.label());
  for (int i = 0; i < system_.order(); ++i) row.scalar("x", "", u.value(first_state_ + i));
  for (int i = 0; i < system_.order(); ++i) row.scalar("xP", "", u.rate(first_state_ + i));
  row.end();
}

int LinearSystemElement::private_datum(std::string_view name) const {
  return index_of(private_data(), name);
}

std::vector<Datum> LinearSystemElement::private_data() const {
  std::vector<Datum> data;
  for (const char* word : {"x", "xP"})
    for (int i = 1; i <= system_.order(); ++i)
      data.push_back({std::string(word) + "[" + std::to_string(i) + "]", ""});
  return data;
}

double LinearSystemElement::private_value(const GeneralView& u, int datum) const {
  const int n = system_.order();
  return datum < n ? u.value(first_state_ + datum) : u.rate(first_state_ + datum - n);
}

}  // namespace mbcosim
