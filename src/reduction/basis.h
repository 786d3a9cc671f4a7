/// The shapes of a reduction before they are made orthogonal and independent.
#pragma once

#include <memory>

#include "reduction/reduce.h"
#include "reduction/structure.h"

namespace mbcosim {

struct BasisShapes {
  MatX shapes;  ///< (model rows × columns), static shapes first
  int static_count = 0;
  std::vector<double> normal_frequencies;  ///< [Hz]
  double eigen_residual = 0;
  long factor_nonzeros = 0;
};

/// Model, options and the structures that they define; factorizations are shared.
class BasisBuilder {
 public:
  BasisBuilder(const FeModel& model, const ReductionOptions& options,
               const ReductionProgress& progress, std::vector<std::string>& warnings);

  BasisShapes build();
  /// With the supports held, and nothing else.
  Structure& body() { return *body_; }
  /// Also with the node of the floating frame held, when it is at a node.
  Structure& attached() { return attached_ ? *attached_ : *body_; }
  ReductionFrame frame() const { return frame_; }
  const std::vector<int>& interface_rows() const { return interface_; }
  /// What unit loads at the interface rows, balanced by inertia when the body can move, displace
  /// there, each row its own.
  const VecX& interface_flexibility();

 private:
  Structure& omitted();  ///< with the interface held
  void choose_frame();
  void find_interface();
  void check_options();
  void require_supported(const char* what);
  void add_modes(Structure& structure, BasisShapes& basis);
  int mode_count(Structure& structure) const;
  void check_count(Structure& structure, const NormalModes& modes);
  static void check_count_of_shapes(std::size_t count);
  MatX unit_loads(const Structure& structure) const;
  MatX constraint_shapes(Structure& omitted) const;
  MatX relief_shapes();
  VecX condensed_flexibility(Structure& omitted, const MatX& shapes);
  void report(const std::string& phase, double fraction) const;

  const FeModel& model_;
  const ReductionOptions& options_;
  const ReductionProgress& progress_;
  std::vector<std::string>& warnings_;
  FactorSettings settings_;
  ReductionFrame frame_ = ReductionFrame::point;
  int frame_node_ = -1;
  std::unique_ptr<Structure> body_, attached_, omitted_;
  std::vector<int> interface_;  ///< model rows
  VecX flexibility_;            ///< at these, when it is known
};

}  // namespace mbcosim
