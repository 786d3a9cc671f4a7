#include "reduction/basis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/decompositions.h"

namespace mbcosim {

namespace {

constexpr int kShapesAtOnce = 32;
constexpr double kNearlyFree = 1e-5;
constexpr double kPoorResidual = 1e4;  ///< times the tolerance
constexpr double kPoorRounding = 1e3;
constexpr double kNoStiffness = 1e-12;  ///< relative

std::vector<char> with_rows_held(std::vector<char> held, const std::vector<int>& rows) {
  for (const int row : rows) held[row] = 1;
  return held;
}

bool is_static(ReductionBasis basis) {
  return basis != ReductionBasis::free_modes && basis != ReductionBasis::constrained_modes;
}

[[noreturn]] void refuse_processor(const std::string& name) {
  std::string accepted = "auto";
  for (const BlockKernels* kernels : block_kernels())
    accepted += std::string(", ") + kernels->processor;
  refuse_reduction("this program and processor cannot do with `" + name + "`",
                   "accepted: " + accepted);
}

}  // namespace

BasisBuilder::BasisBuilder(const FeModel& model, const ReductionOptions& options,
                           const ReductionProgress& progress, std::vector<std::string>& warnings)
    : model_(model), options_(options), progress_(progress), warnings_(warnings) {
  settings_.threads = options.threads;
  settings_.kernels = find_block_kernels(options.processor);
  settings_.progress = progress;
  if (!settings_.kernels) refuse_processor(options.processor);
  report("rigid motions", 0);
  body_ = std::make_unique<Structure>(model, model.supported, settings_);
  if (body_->softest() < kNearlyFree && body_->rigid_count() < 6)
    warnings_.push_back(
        "the stiffness matrix hardly resists a rigid motion: if the body should be free, write the "
        "matrix with more digits or check the coordinates");
  choose_frame();
  find_interface();
  check_options();
}

// Dense algorithms follow, whose time grows with the cube of the number.
void BasisBuilder::check_count_of_shapes(std::size_t count) {
  constexpr std::size_t kMost = 2000;
  if (count > kMost)
    refuse_reduction("the reduced model would have more than " + std::to_string(kMost) +
                         " shapes, one for each component of an interface node and each mode",
                     "name fewer interface nodes or components, or ask for fewer modes");
}

void BasisBuilder::report(const std::string& phase, double fraction) const {
  if (progress_ && !progress_(phase, fraction)) stop_reduction();
}

void BasisBuilder::choose_frame() {
  const bool moves = body_->rigid_count() > 0;
  frame_ = options_.frame;
  if (frame_ == ReductionFrame::automatic)
    frame_ = moves ? ReductionFrame::mean_axes : ReductionFrame::point;
  if (frame_ == ReductionFrame::point && moves)
    refuse_reduction("the body has " + std::to_string(body_->rigid_count()) +
                         " rigid motions, which a frame at a fixed point would leave in the shapes",
                     "choose mean axes or the frame of a node");
  if (frame_ == ReductionFrame::mean_axes && !moves)
    refuse_reduction("mean axes are for bodies that can move, this one is supported",
                     "remove the supports, or place the frame at a point");
  if (frame_ != ReductionFrame::node) return;
  frame_node_ = model_.node(options_.frame_node);
  if (options_.basis == ReductionBasis::free_modes)
    refuse_reduction("free modes do not vanish at node " + options_.frame_node,
                     "use constrained modes, or mean axes");
  if (options_.basis == ReductionBasis::inertia_decoupling)
    refuse_reduction("inertia decoupling refers to mean axes, not to a node", "use inertia relief");
  attached_ = std::make_unique<Structure>(
      model_, with_rows_held(model_.supported, model_.rows_of(frame_node_)), settings_);
}

void BasisBuilder::find_interface() {
  for (const std::string& label : options_.interface_nodes) {
    const int node = model_.node(label);
    std::vector<int> rows = model_.rows_of(node);
    const auto digits = options_.interface_components.find(label);
    if (digits != options_.interface_components.end()) {
      rows.clear();
      for (const int component : parse_components(digits->second))
        if (const int row = model_.row(node, component); row >= 0) rows.push_back(row);
    }
    for (const int row : rows) {
      if (std::find(interface_.begin(), interface_.end(), row) != interface_.end())
        refuse_reduction(model_.dof_text(row) + " is an interface twice");
      if (attached().position(row) >= 0) interface_.push_back(row);
      check_count_of_shapes(interface_.size());
    }
  }
}

void BasisBuilder::check_options() {
  if (options_.modes < 0) refuse_reduction("the number of normal modes must not be negative");
  check_count_of_shapes(interface_.size() + static_cast<std::size_t>(options_.modes));
  if (!(options_.max_frequency >= 0))
    refuse_reduction("the highest frequency must not be negative");
  for (const auto& [label, digits] : options_.interface_components)
    if (std::find(options_.interface_nodes.begin(), options_.interface_nodes.end(), label) ==
        options_.interface_nodes.end())
      refuse_reduction("components are given for node " + label + ", which is no interface node");
  if (is_static(options_.basis) && interface_.empty())
    refuse_reduction(std::string(basis_name(options_.basis)) +
                     " needs interface nodes that can move");
  if (!is_static(options_.basis) && options_.modes == 0 && options_.max_frequency <= 0)
    refuse_reduction("a basis of normal modes needs at least one");
  if (!is_static(options_.basis) && options_.normal == ReductionNormal::omitted)
    refuse_reduction("modes with the interface held are for bases with static shapes",
                     "craig-bampton, complement, inertia-relief or inertia-decoupling");
  if (options_.basis == ReductionBasis::inertia_decoupling && body_->rigid_count() == 0)
    refuse_reduction("inertia decoupling is for bodies that can move, this one is supported");
  if (options_.basis == ReductionBasis::free_modes && body_->rigid_count() == 0)
    warnings_.push_back("the body is supported: its free modes are the constrained ones");
}

void BasisBuilder::require_supported(const char* what) {
  if (attached().rigid_count() == 0) return;
  refuse_reduction(std::string(what) + ": the body has " +
                       std::to_string(attached().rigid_count()) + " rigid motions",
                   "give supports, place the frame at a node, or use inertia relief");
}

int BasisBuilder::mode_count(Structure& structure) const {
  if (options_.max_frequency <= 0) return options_.modes;
  const double omega = 2 * std::numbers::pi * options_.max_frequency;
  const int count = structure.count_modes_below(omega * omega);
  if (count < 0)
    throw ReductionError(ErrorKind::not_converged,
                         "the modes below the highest frequency could not be counted");
  check_count_of_shapes(interface_.size() + static_cast<std::size_t>(count));
  if (count == 0 && !is_static(options_.basis))
    refuse_reduction("the body has no normal mode below the highest frequency",
                     "raise it, or ask for a number of modes");
  return count;
}

void BasisBuilder::add_modes(Structure& structure, BasisShapes& basis) {
  report("normal modes", 0);
  const int count = mode_count(structure);
  const EigenOptions eigen{options_.eigen_tolerance, options_.shift};
  const NormalModes modes = structure.modes(count, eigen, progress_);
  if (modes.residual > std::max(kPoorResidual * eigen.tolerance, kPoorRounding * modes.rounding))
    warnings_.push_back("the normal modes satisfy their equation only to " +
                        std::to_string(modes.residual));
  basis.eigen_residual = modes.residual;
  basis.factor_nonzeros = structure.factor_nonzeros();
  if (options_.check_completeness && count > 0) {
    if (&structure == omitted_.get()) structure.release_factor();  // no longer needed
    check_count(structure, modes);
  }
  for (const double square : modes.squares) basis.normal_frequencies.push_back(hertz(square));
  const auto before = basis.shapes.cols();
  basis.shapes.conservativeResize(model_.rows(), before + count);
  basis.shapes.rightCols(count) = structure.embedded(modes.shapes);
}

/// As many eigenvalues lie below the middle of the widest upper gap as were found there; equal
/// ones have none between them.
void BasisBuilder::check_count(Structure& structure, const NormalModes& modes) {
  report("count of the modes", 0);
  const int n = static_cast<int>(modes.squares.size());
  constexpr double kEqual = 1e-6;  // relative
  int at = 0;                      // eigenvalues below index `at` are counted
  double widest = 0;
  for (int k = n - 1; k > 0 && (k > n - 5 || at == 0); --k) {
    const double gap = modes.squares(k) / modes.squares(k - 1) - 1;
    if (gap > std::max(kEqual, 4 * widest)) {
      widest = gap;
      at = k;
    }
  }
  const double mu =
      at == 0 ? 0.5 * modes.squares(0) : std::sqrt(modes.squares(at) * modes.squares(at - 1));
  const int counted = structure.count_modes_below(mu);
  if (counted >= 0 && counted != at)
    warnings_.push_back("the model has " + std::to_string(counted) + " normal modes below " +
                        std::to_string(hertz(mu)) + " Hz, " + std::to_string(at) + " were found");
}

Structure& BasisBuilder::omitted() {
  if (omitted_) return *omitted_;
  std::vector<char> held = with_rows_held(model_.supported, interface_);
  if (frame_node_ >= 0) held = with_rows_held(held, model_.rows_of(frame_node_));
  if (std::all_of(held.begin(), held.end(), [](char h) { return h != 0; }))
    refuse_reduction("all degrees of freedom belong to the interface: nothing is left to reduce",
                     "name fewer interface nodes or components");
  omitted_ = std::make_unique<Structure>(model_, held, settings_);
  if (omitted_->rigid_count() > 0)
    refuse_reduction("the body can move while its interface is held",
                     "name more interface nodes or components");
  return *omitted_;
}

/// Unit loads at the interface, rows of `structure`.
MatX BasisBuilder::unit_loads(const Structure& structure) const {
  MatX loads = MatX::Zero(structure.size(), interface_.size());
  for (std::size_t k = 0; k < interface_.size(); ++k)
    loads(structure.position(interface_[k]), k) = 1;
  return loads;
}

/// Ψ = [−K_oo⁻¹ K_op; 1], model rows.
MatX BasisBuilder::constraint_shapes(Structure& omitted) const {
  const int count = static_cast<int>(interface_.size());
  MatX shapes(model_.rows(), count);
  for (int done = 0; done < count;) {
    const int columns = std::min(kShapesAtOnce, count - done);
    MatX forces = MatX::Zero(omitted.size(), columns);
    for (int k = 0; k < columns; ++k)
      for (SparseMatrix::InnerIterator it(model_.stiffness, interface_[done + k]); it; ++it)
        if (const int row = omitted.position(it.row()); row >= 0) forces(row, k) = -it.value();
    shapes.middleCols(done, columns) = omitted.embedded(omitted.solve(forces));
    done += columns;
    report("static shapes", double(done) / count);
  }
  for (int k = 0; k < count; ++k) shapes(interface_[k], k) = 1;
  return shapes;
}

/// K⁻ P f. A supported body is relieved by its six geometric motions.
MatX BasisBuilder::relief_shapes() {
  MatX loads = unit_loads(*body_);
  if (body_->rigid_count() > 0) {
    loads = body_->balanced(loads);
  } else {
    const MatX x = body_->restricted(model_.rigid_shapes(model_.positions.rowwise().mean()));
    const MatX inertia_load = body_->mass() * x;
    const Eigen::CompleteOrthogonalDecomposition<MatX> inertia(x.transpose() * inertia_load);
    loads -= inertia_load * inertia.solve(x.transpose() * loads);
  }
  Structure& s = attached();
  return s.embedded(s.solve(s.restricted(body_->embedded(loads))));
}

/// From the constraint shapes Ψ alone, with balanced loads f and S = Ψᵀ K Ψ:
///
///   fᵀ K⁻ f = (Ψᵀ f)ᵀ S⁻ Ψᵀ f + f_oᵀ K_oo⁻¹ f_o
///
/// S is singular by the rigid motions of the body only; otherwise empty: the factorization of the
/// whole body names what is wrong.
VecX BasisBuilder::condensed_flexibility(Structure& omitted, const MatX& shapes) {
  Structure& s = attached();
  const MatX loads = s.embedded(s.balanced(unit_loads(s))), at_shapes = shapes.transpose() * loads;
  const MatX stiffness = shapes.transpose() * (model_.stiffness * shapes);
  const VecX scale = stiffness.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatX> solver(
      MatX(scale.asDiagonal() * stiffness * scale.asDiagonal()));
  const auto elastic = stiffness.rows() - s.rigid_count();
  if (solver.info() != Eigen::Success || elastic < 0) return {};
  const VecX values = solver.eigenvalues().tail(elastic);
  if (elastic > 0 && !(values(0) > kNoStiffness * values(elastic - 1))) return {};
  const MatX amplitudes =
      solver.eigenvectors().rightCols(elastic).transpose() * (scale.asDiagonal() * at_shapes);
  VecX sum = (amplitudes.array().square().colwise() / values.array()).colwise().sum();
  if (s.rigid_count() == 0) return sum;  // nothing acts on the other rows
  const MatX others = omitted.restricted(loads);
  return sum +
         (others.array() * omitted.solve(others).array()).colwise().sum().matrix().transpose();
}

const VecX& BasisBuilder::interface_flexibility() {
  if (flexibility_.size() > 0) return flexibility_;
  Structure& s = attached();
  const MatX loads = s.balanced(unit_loads(s));
  flexibility_ = (loads.array() * s.solve(loads).array()).colwise().sum();
  return flexibility_;
}

BasisShapes BasisBuilder::build() {
  BasisShapes basis;
  basis.shapes.resize(model_.rows(), 0);
  switch (options_.basis) {
    case ReductionBasis::free_modes:
      add_modes(*body_, basis);
      break;
    case ReductionBasis::constrained_modes:
      require_supported("constrained modes");
      add_modes(attached(), basis);
      break;
    case ReductionBasis::craig_bampton: {
      if (!options_.interface_components.empty())
        warnings_.push_back(
            "Craig-Bampton with some components of an interface node: the others have no static "
            "shape of their own");
      basis.shapes = constraint_shapes(omitted());
      basis.static_count = static_cast<int>(interface_.size());
      flexibility_ = condensed_flexibility(omitted(), basis.shapes);
      add_modes(options_.normal == ReductionNormal::whole ? attached() : omitted(), basis);
      break;
    }
    case ReductionBasis::complement:
      require_supported("complement shapes");
      report("static shapes", 0);
      basis.shapes = attached().embedded(attached().solve(unit_loads(attached())));
      basis.static_count = static_cast<int>(interface_.size());
      add_modes(options_.normal == ReductionNormal::omitted ? omitted() : attached(), basis);
      break;
    case ReductionBasis::inertia_relief:
    case ReductionBasis::inertia_decoupling:
      report("static shapes", 0);
      basis.shapes = relief_shapes();
      if (options_.basis == ReductionBasis::inertia_decoupling)
        basis.shapes = body_->embedded(body_->without_rigid(body_->restricted(basis.shapes)));
      basis.static_count = static_cast<int>(interface_.size());
      add_modes(options_.normal == ReductionNormal::omitted ? omitted() : attached(), basis);
      break;
  }
  omitted_.reset();
  return basis;
}

}  // namespace mbcosim
