/// From a finite element model to a FEM data file: a basis of shapes Φ for the modal joint.
///
///   x ≈ Φ q,   M_r = Φᵀ M Φ,   K_r = Φᵀ K Φ
///
/// Bases, with p the interface rows and o the others:
///
///   free, constrained   normal modes of the body, of the supported body
///   Craig-Bampton       Ψ = [−K_oo⁻¹ K_op; 1] and the normal modes of (K_oo, M_oo)
///   complement          columns p of K⁻¹ and normal modes
///   inertia relief      K⁻ P [0; 1]_p and normal modes
///   inertia decoupling  Pᵀ K⁻ P [0; 1]_p and normal modes
///
/// Rigid motion belongs to the modal node: the basis of a body that can move is made orthogonal to
/// it (mean axes), or vanishes at the node that carries the floating frame. Dependent shapes are
/// removed. Source: MBDyn tutorials, "Modal body", shape selection, eqs. 8.1 to 8.17.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "elements/modal/fem_data.h"
#include "reduction/error.h"
#include "reduction/fe_model.h"

namespace mbcosim {

enum class ReductionBasis {
  free_modes,
  constrained_modes,
  craig_bampton,
  complement,
  inertia_relief,
  inertia_decoupling
};

/// Where the floating frame is. `automatic`: mean axes for a body that can move, else as the model.
enum class ReductionFrame { automatic, mean_axes, node, point };

/// Of which structure the normal modes are: with the interface held (`omitted`) or not (`whole`).
/// `automatic`: omitted for Craig-Bampton, else whole.
enum class ReductionNormal { automatic, omitted, whole };

/// How the body's inertia is written: group 11, group 12, both, or not at all.
enum class ReductionInertia { lumped, rigid, both, none };

struct ReductionOptions {
  ReductionBasis basis = ReductionBasis::craig_bampton;
  std::vector<std::string> interface_nodes;
  std::map<std::string, std::string> interface_components;  ///< label -> digits; absent: all
  int modes = 10;                                           ///< normal modes
  double max_frequency = 0;  ///< [Hz]; above zero: all normal modes below, instead of `modes`
  ReductionFrame frame = ReductionFrame::automatic;
  std::string frame_node;  ///< of ReductionFrame::node
  Vec3 frame_point = Vec3::Zero();
  ReductionInertia inertia = ReductionInertia::lumped;
  std::vector<std::string> exposed;  ///< nodes that the file lists, or "interface"; empty: all
  bool diagonalize = true;           ///< M_r = 1 and K_r = diag(ω²)
  double rank_tolerance = 1e-8;
  ReductionNormal normal = ReductionNormal::automatic;
  bool must_be_lumped = false;  ///< refuse a mass matrix that is not lumped instead of lumping it
  double eigen_tolerance = 1e-10;  ///< relative, of the normal modes
  double shift = 0;  ///< [1/s²] of the Lanczos process, at most 0; 0: a determinate set of rows is
                     ///< held instead
  std::string processor = "auto";  ///< version of the kernels: auto, plain, x86-64-v3, x86-64-v4
  int threads = 1;                 ///< of factorizations and solutions; does not change results
  bool check_completeness = true;  ///< count the eigenvalues below the highest normal mode
};

struct ReductionReport {
  int unknowns = 0, rigid_motions = 0, normal_modes = 0, static_shapes = 0, removed_shapes = 0;
  std::vector<double> frequencies;         ///< of the reduced body [Hz]
  std::vector<double> normal_frequencies;  ///< of the normal modes in the basis [Hz]
  MatX effective_masses;                   ///< (6 × shapes): masses [kg], inertias [kg m²]
  FemRigidInertia inertia;  ///< about the floating frame's origin: centre, inertia about the centre
  double static_error =
      0;  ///< largest relative error of the flexibility at the interface; −1: no interface
  std::string static_error_at;
  double eigen_residual = 0;
  double lumping_change = 0;  ///< largest relative change of a frequency by lumping
  long factor_nonzeros = 0;
  std::vector<std::string> warnings;
};

struct Reduction {
  FemData data;
  ReductionReport report;
  std::vector<std::string> comments;  ///< for the head of the file
};

/// Errors: `argument` (model or options), `not_converged`, `cancelled`.
Result<Reduction> reduce(const FeModel& model, const ReductionOptions& options,
                         const ReductionProgress& progress = {});

/// The report as text, and as one JSON object.
std::string report_text(const Reduction& reduction);
std::string report_json(const Reduction& reduction);
/// The basis by its name in options: "craig-bampton"; throws ReductionError for an unknown one.
ReductionBasis parse_basis(const std::string& name);
const char* basis_name(ReductionBasis basis);

}  // namespace mbcosim
