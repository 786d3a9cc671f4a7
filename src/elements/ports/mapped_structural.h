/// Loads from an external code whose points follow those of the model by a matrix: `force: …,
/// external structural mapping`.
#pragma once

#include "elements/ports/external_structural.h"
#include "elements/ports/port_element.h"

namespace mbcosim {

/// With positions x of the points (3P, relative to the reference node in its frame when there is
/// one), the peer sees x̂ = H x and v̂ = H v, and its forces act on the points as F = Hᵀ F̂, so that
/// virtual work is kept. Only forces travel, no moments. Source: MBDyn input manual, structural
/// forces, external structural mapping.
class MappedStructural : public ExternalStructural, public PortElement {
 public:
  MappedStructural(StructuralPort points, ElementPort port, MappingMatrix mapping)
      : ExternalStructural(points, false),
        points_(std::move(points)),
        port_(std::move(port)),
        mapping_(std::move(mapping)) {}
  const ElementPort& port() const override { return port_; }
  void outputs(const GeneralView&, std::vector<double>&) const override {}
  const StructuralPort* points() const override { return &points_; }
  const MappingMatrix* mapping() const override { return &mapping_; }

 private:
  StructuralPort points_;
  ElementPort port_;
  MappingMatrix mapping_;  ///< H (3 × peer's points, 3 × points)
};

}  // namespace mbcosim
