/// Thermal networks: heat flows between thermal nodes. The row of a node is the balance of the heat
/// into it [W]. MBDyn input manual, "Thermal elements".
#pragma once

#include "elements/element.h"
#include "model/drive.h"

namespace mbcosim {

/// Heat stored in a node: −C Ṫ.
struct ThermalCapacitance {
  int node;  ///< scalar node index
  double C;  ///< [J/K]

  static constexpr int width = 1;
  void connect(Connector& c) const { c.scalar(node); }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.scalar(0, u.scalar_rate(0) * -C);
  }
  std::string log(const Model& model, int label) const;
};

/// Conduction between two nodes: q = (T₂ − T₁)/R into node 1 and out of node 2.
struct ThermalResistance {
  int node1, node2;
  double R;  ///< [K/W]

  static constexpr int width = 2;
  void connect(Connector& c) const {
    c.scalar(node1);
    c.scalar(node2);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T q = (u.scalar(1) - u.scalar(0)) * (1 / R);
    r.scalar(0, q);
    r.scalar(1, -q);
  }
  std::string log(const Model& model, int label) const;
};

/// Heat from outside: Q(t) into a node.
struct ThermalSource {
  int node;
  DrivePtr heat;  ///< [W]

  static constexpr int width = 1;
  void connect(Connector& c) const {
    c.scalar(node);
    c.drives(heat);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.scalar(0, u.drive(heat));
  }
  std::string log(const Model& model, int label) const;
};

}  // namespace mbcosim
