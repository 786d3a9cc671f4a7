#pragma once

#include <vector>

#include "elements/joints/joint_common.h"
#include "model/law.h"

namespace mbcosim {

/// Base of deformable joints: a constitutive law in N dimensions whose arguments `Joint::arguments`
/// computes.
///
///   template <class T> void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const
///
/// Private data: `Joint::data_names`, then `constitutiveLaw.<name>` as the law knows them.
template <class Joint, int N>
struct LawUser {
  template <class T>
  using V = Eigen::Matrix<T, N, 1>;
  LawPtr<N> law;

  template <class T>
  V<T> law_force(const Local<T>& u) const {
    V<T> strain, rate;
    self().arguments(u, strain, rate);
    return law->template force<T>(*u.context, strain, rate);
  }
  void after_predict(const Local<double>& u, State& state) const {
    if (!law->has_memory()) return;
    V<double> strain, rate;
    self().arguments(u, strain, rate);
    law->after_predict(*u.context, state, strain, rate);
  }
  /// The law sees the start as if it had been predicted.
  void at_derivatives(const Local<double>& u, State& state, bool first) const {
    if (first) LawUser::after_predict(u, state);
  }
  void after_convergence(const Local<double>& u, State& state) const {
    if (!law->has_memory()) return;
    V<double> strain, rate;
    self().arguments(u, strain, rate);
    law->after_convergence(*u.context, state, strain, rate);
  }
  bool has_rate() const { return law->type() != LawType::elastic; }

  static constexpr std::string_view law_prefix = "constitutiveLaw.";
  int private_datum(std::string_view name) const {
    if (name.substr(0, law_prefix.size()) == law_prefix) {
      const int k = law->private_datum(std::string(name.substr(law_prefix.size())));
      return k < 0 ? -1 : k + static_cast<int>(Joint::data_names.size());
    }
    return index_of(Joint::data_names, name);
  }
  std::vector<Datum> private_data() const { return data_of(Joint::data_names); }
  double private_value(const Local<double>& u, int datum) const {
    constexpr int own = static_cast<int>(Joint::data_names.size());
    if (datum < own) return self().own_datum(u, datum);
    double values[8];
    law_output(u, values);
    return values[datum - own];
  }
  /// Columns that the law adds to the joint's line.
  void output_law(const Local<double>& u, OutputRow& row) const {
    const int count = law->output_size();
    if (count == 0) return;
    std::vector<double> values(count);
    law_output(u, values.data());
    row.values("constitutiveLaw", "", values.data(), count);
  }

 private:
  const Joint& self() const { return static_cast<const Joint&>(*this); }
  void law_output(const Local<double>& u, double* values) const {
    V<double> strain, rate;
    self().arguments(u, strain, rate);
    law->output(*u.context, strain, rate, values);
  }
};

}  // namespace mbcosim
