#pragma once

#include <cmath>

#include "elements/element.h"
#include "elements/user/readers.h"

namespace mbcosim {

/// Electric motor fed with alternating current. S = Ω_S(t), σ = sign S, s = 1 − ω/S the slip, e the
/// third axis of the stator:
///
///   unknowns  y [N·m/s], M [N·m], ω [rad/s], all differential
///   rows      ẏ + (2 s_K + σ ω̇/(s S²)) |S| y + ((s_K² + s²) S² + σ ω̇ s_K/s) M − 2 M_K s_K s S²
///             Ṁ − y,  ω − e·(w_rotor − w_stator);  switched off: y, M instead of the first two
///   loads     rotor σ M e, stator −σ M e
struct AsynchronousMachine {
  int rotor = -1, stator = -1;
  double M_K = 0;        ///< breakdown torque [N·m]
  double s_K = 0;        ///< breakdown slip
  DrivePtr synchronous;  ///< Ω_S [rad/s]
  DrivePtr on;           ///< null: always
  double M0 = 0, MP0 = 0;

  static constexpr int width = 15;

  void connect(Connector& c) const {
    c.distinct_node(rotor);
    c.distinct_node(stator);
    c.differential(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> e = u.R(1).col(2);
    const double S = value_of(u.drive(synchronous)), sigma = S < 0 ? -1 : 1;
    const T y = u.own(0), M = u.own(1), omega = u.own(2);
    r.moment(0, e * T(M * sigma));
    r.moment(1, e * T(M * -sigma));
    r.own(2, e.dot(u.w(0) - u.w(1)) - omega);
    if (on && value_of(u.drive(on)) == 0) {
      r.own(0, -y);
      r.own(1, -M);
      return;
    }
    if (S == 0) throw EvaluationError("asynchronous_machine: the synchronous speed is zero");
    const T s = T(1.0) - omega * (1 / S);
    if (value_of(s) == 0)
      throw EvaluationError("asynchronous_machine: the rotor turns at the synchronous speed");
    const T growth = u.own_rate(2) * sigma / s;
    r.own(0, s * (2 * M_K * s_K * S * S) - u.own_rate(0) -
                 (growth * (1 / (S * S)) + 2 * s_K) * std::abs(S) * y -
                 ((s * s + s_K * s_K) * (S * S) + growth * s_K) * M);
    r.own(1, y - u.own_rate(1));
  }
  void start(Start& s) const {
    s.own(0) = s.own_rate(1) = MP0;
    s.own(1) = M0;
    s.own(2) = (s.u.R(1).col(2)).dot(s.u.w(0) - s.u.w(1));
  }
  void output(const Local<double>& u, OutputRow& row) const {
    row.begin(OutputFile::usr, u.label());
    row.scalar("M", "N m", u.own(1));
    row.scalar("MP", "N m/s", u.own(0));
    row.scalar("omega", "rad/s", u.own(2));
    row.end();
  }
  static constexpr std::array<DatumName, 2> data_names = {{{"M", "N m"}, {"omega", "rad/s"}}};
  static int private_datum(std::string_view name) { return index_of(data_names, name); }
  static std::vector<Datum> private_data() { return data_of(data_names); }
  static double private_value(const Local<double>& u, int datum) { return u.own(1 + datum); }
  static std::string row_name(int k) {
    return k == 0 ? "torque" : k == 1 ? "rate of the torque" : "speed of the rotor";
  }
};

}  // namespace mbcosim
