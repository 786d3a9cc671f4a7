#include "reduction/reduce.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <numbers>
#include <optional>

#include "math/decompositions.h"
#include "reduction/basis.h"
#include "reduction/inertia.h"

namespace mbcosim {

namespace {

constexpr double kRigidShare = 1e-6;  ///< of the first elastic ω², accepted in the basis
constexpr double kTiny = 1e-14;       ///< entries below, relative, become zero
constexpr double kLumpingChange = 0.01;

MatX symmetric(const MatX& m) { return 0.5 * (m + m.transpose()); }

MatX without_dust(MatX m) {
  const double small = kTiny * m.cwiseAbs().maxCoeff();
  return m.unaryExpr([small](double v) { return std::abs(v) < small ? 0 : v; });
}

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// ω² of the pair (K, M), ascending, and its vectors, M-normalised; massless ones last,
/// K-normalised.
struct ReducedPair {
  VecX squares;
  MatX vectors;
};
ReducedPair solve_pair(const MatX& stiffness, const MatX& mass) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> solver(mass, stiffness);
  if (solver.info() != Eigen::Success)
    refuse_reduction("the basis holds a rigid motion or a dependent shape");
  const auto n = mass.rows();
  ReducedPair pair{VecX(n), solver.eigenvectors().rowwise().reverse()};
  const double largest = solver.eigenvalues()(n - 1);
  for (int j = 0; j < n; ++j) {
    const double mu = solver.eigenvalues()(n - 1 - j);
    const bool massless = !(mu > kTiny * largest);
    pair.squares(j) = massless ? std::numeric_limits<double>::infinity() : 1 / mu;
    if (!massless) pair.vectors.col(j) /= std::sqrt(mu);
  }
  return pair;
}

class Reducer {
 public:
  Reducer(const FeModel& model, const ReductionOptions& options, const ReductionProgress& progress)
      : original_(model), options_(options), progress_(progress) {}

  Reduction run() {
    choose_nodes();
    lump();
    builder_ = std::make_unique<BasisBuilder>(*model_, options_, progress_, report_.warnings);
    BasisShapes basis = builder_->build();
    describe(basis);
    shapes_ = std::move(basis.shapes);
    if (builder_->frame() == ReductionFrame::mean_axes) remove_rigid_content();
    make_independent();
    project();
    measure();
    write();
    return std::move(result_);
  }

 private:
  void choose_nodes() {
    if (options_.exposed.empty()) {
      for (std::size_t n = 0; n < model_->labels.size(); ++n) nodes_.push_back(static_cast<int>(n));
    } else {
      for (const std::string& label : options_.exposed)
        if (label != "interface") nodes_.push_back(model_->node(label));
      for (const std::string& label : options_.interface_nodes)
        nodes_.push_back(model_->node(label));
      std::sort(nodes_.begin(), nodes_.end());
      nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
    }
  }

  bool writes_lumped() const {
    return options_.inertia == ReductionInertia::lumped ||
           options_.inertia == ReductionInertia::both;
  }

  /// Groups 9 and 11 must agree: with group 11 the whole reduction uses the lumped mass.
  void lump() {
    std::string warning;
    report_.inertia = rigid_inertia(original_, warning);
    if (!warning.empty()) report_.warnings.push_back(warning);
    center_ = report_.inertia.center;
    if (!writes_lumped()) return;
    if (nodes_.size() < model_->labels.size())
      refuse_reduction("lumped inertia needs all nodes of the model in the file",
                       "write all nodes, or choose rigid inertia");
    if (!is_lumped(*model_)) {
      if (options_.must_be_lumped)
        refuse_reduction("the mass matrix is not lumped",
                         "lump it (`lumping = hrz`), or choose rigid inertia");
      lumped_model_ = original_;
      lumped_model_->mass = lumped_mass(original_);
      model_ = &*lumped_model_;
    }
    lumped_ = nodal_inertia(*model_, model_->mass);
    center_ = rigid_inertia(*model_, warning).center;
  }

  void describe(const BasisShapes& basis) {
    report_.unknowns = model_->rows();
    report_.rigid_motions = builder_->body().rigid_count();
    report_.normal_modes = static_cast<int>(basis.normal_frequencies.size());
    report_.static_shapes = basis.static_count;
    report_.normal_frequencies = basis.normal_frequencies;
    report_.eigen_residual = basis.eigen_residual;
    report_.factor_nonzeros = basis.factor_nonzeros;
  }

  void remove_rigid_content() {
    Structure& body = builder_->body();
    shapes_ = body.embedded(body.without_rigid(body.restricted(shapes_)));
  }

  /// Scales the shapes to unit energy and drops combinations without energy of their own.
  void make_independent() {
    const VecX energy = (shapes_.array() * (model_->stiffness * shapes_).array()).colwise().sum();
    const VecX inertia = (shapes_.array() * (model_->mass * shapes_).array()).colwise().sum();
    std::vector<int> strained;
    const double stiffest = energy.cwiseAbs().cwiseQuotient(inertia.cwiseMax(1e-300)).maxCoeff();
    for (int j = 0; j < shapes_.cols(); ++j)
      if (energy(j) > 1e-14 * stiffest * inertia(j)) strained.push_back(j);
    MatX scaled(shapes_.rows(), strained.size());
    VecX scales(strained.size());
    for (std::size_t k = 0; k < strained.size(); ++k) {
      scales(k) = std::sqrt(energy(strained[k]));
      scaled.col(k) = shapes_.col(strained[k]) / scales(k);
    }
    if (strained.empty()) refuse_reduction("no shape deforms the body");
    const Eigen::SelfAdjointEigenSolver<MatX> gram(
        symmetric(scaled.transpose() * (model_->stiffness * scaled)));
    const double limit = options_.rank_tolerance * gram.eigenvalues().maxCoeff();
    const auto kept = (gram.eigenvalues().array() > limit).count();
    report_.removed_shapes = static_cast<int>(shapes_.cols() - kept);
    if (kept == shapes_.cols()) return;  // as they are: physical scale
    shapes_ = scaled * gram.eigenvectors().rightCols(kept);
    const int expected = builder_->frame() == ReductionFrame::mean_axes &&
                                 options_.basis == ReductionBasis::craig_bampton
                             ? report_.rigid_motions
                             : 0;
    if (report_.removed_shapes > expected)
      report_.warnings.push_back(std::to_string(report_.removed_shapes) +
                                 " shapes depend on the others and were removed");
  }

  void project() {
    const auto reduced = [this](const SparseMatrix& m) {
      return symmetric(shapes_.transpose() * (m * shapes_));
    };
    MatX stiffness = reduced(model_->stiffness), mass = reduced(model_->mass);
    const ReducedPair pair = solve_pair(stiffness, mass);
    squares_ = pair.squares;
    check_rigid_content();
    if (lumped_model_) compare_with(solve_pair(stiffness, reduced(original_.mass)).squares);
    if (options_.diagonalize) {
      shapes_ = shapes_ * pair.vectors;
      fix_signs();
      stiffness = MatX::Zero(squares_.size(), squares_.size());
      mass = stiffness;
      for (int j = 0; j < squares_.size(); ++j) {
        const bool massless = std::isinf(squares_(j));
        stiffness(j, j) = massless ? 1 : squares_(j);
        mass(j, j) = massless ? 0 : 1;
      }
    }
    result_.data.mass = without_dust(mass);
    result_.data.stiffness = without_dust(stiffness);
  }

  void fix_signs() {
    for (int j = 0; j < shapes_.cols(); ++j) {
      int at = 0;
      shapes_.col(j).cwiseAbs().maxCoeff(&at);
      if (shapes_(at, j) < 0) shapes_.col(j) *= -1;
    }
  }

  void compare_with(const VecX& consistent) {
    for (int j = 0; j < std::min<int>(squares_.size(), std::max(1, report_.normal_modes)); ++j)
      if (std::isfinite(squares_(j)))
        report_.lumping_change =
            std::max(report_.lumping_change, std::abs(std::sqrt(squares_(j) / consistent(j)) - 1));
    if (report_.lumping_change > kLumpingChange)
      report_.warnings.push_back("lumping the mass changes a frequency by " +
                                 shown(100 * report_.lumping_change) +
                                 " %; rigid inertia keeps the consistent mass");
  }

  void check_rigid_content() {
    const std::vector<double>& normal = report_.normal_frequencies;
    if (normal.empty()) return;
    const double first = 2 * std::numbers::pi * *std::min_element(normal.begin(), normal.end());
    if (!(squares_(0) > kRigidShare * first * first))
      refuse_reduction("the basis holds a rigid motion", "rigid motion belongs to the modal node");
  }

  void measure() {
    for (const double square : squares_) report_.frequencies.push_back(hertz(square));
    measure_effective_masses();
    report_.static_error = -1;
    if (!builder_->interface_rows().empty()) measure_static_error();
    report_.factor_nonzeros = std::max({report_.factor_nonzeros, builder_->body().factor_nonzeros(),
                                        builder_->attached().factor_nonzeros()});
  }

  Vec3 origin() const {
    if (builder_->frame() == ReductionFrame::mean_axes) return center_;
    if (builder_->frame() == ReductionFrame::node)
      return model_->positions.col(model_->node(options_.frame_node));
    return options_.frame_point;
  }

  /// (X_Rᵀ M φ)² / (φᵀ M φ), X_R about the floating frame's origin.
  void measure_effective_masses() {
    const MatX share = model_->rigid_shapes(origin()).transpose() * (model_->mass * shapes_);
    report_.effective_masses = MatX::Zero(6, shapes_.cols());
    for (int j = 0; j < shapes_.cols(); ++j)
      if (const double m = shapes_.col(j).dot(model_->mass * shapes_.col(j)); m > 0)
        report_.effective_masses.col(j) = share.col(j).cwiseAbs2() / m;
  }

  /// Flexibility at the interface: of the basis against that of the model.
  void measure_static_error() {
    if (progress_ && !progress_("static error", 0)) stop_reduction();
    const std::vector<int>& rows = builder_->interface_rows();
    const VecX& exact = builder_->interface_flexibility();
    MatX at(rows.size(), shapes_.cols());
    for (std::size_t k = 0; k < rows.size(); ++k) at.row(k) = shapes_.row(rows[k]);
    const MatX reduced = at * result_.data.stiffness.ldlt().solve(MatX(at.transpose()));
    report_.static_error = 0;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double error = std::abs(reduced(k, k) / exact(k) - 1);
      if (!(error > report_.static_error)) continue;
      report_.static_error = error;
      report_.static_error_at = model_->dof_text(rows[k]);
    }
  }

  void write() {
    FemData& data = result_.data;
    const int modes = static_cast<int>(shapes_.cols());
    const int count = static_cast<int>(nodes_.size());
    data.revision = "REV0";
    data.normal = modes;
    data.positions.resize(3, count);
    data.shapes = MatX::Zero(6 * count, modes);
    for (int k = 0; k < count; ++k) {
      data.labels.push_back(model_->labels[nodes_[k]]);
      data.positions.col(k) = Vec3(model_->positions.col(nodes_[k])) - origin();
      for (int c = 0; c < 6; ++c)
        if (const int row = model_->row(nodes_[k], c); row >= 0)
          data.shapes.row(6 * k + c) = shapes_.row(row);
    }
    data.initial_amplitudes = data.initial_velocities = VecX::Zero(modes);
    report_.inertia.center -= origin();
    if (writes_lumped()) data.lumped = lumped_;
    if (options_.inertia == ReductionInertia::rigid || options_.inertia == ReductionInertia::both)
      data.rigid = report_.inertia;
    if (options_.inertia == ReductionInertia::rigid)
      report_.warnings.push_back(
          "rigid inertia: gravity and accelerations of the body do not load its modes");
    result_.report = std::move(report_);
    comment();
  }

  void comment() {
    const ReductionReport& r = result_.report;
    result_.comments = {std::string("mbcosim reduce: ") + basis_name(options_.basis) + ", " +
                            std::to_string(r.normal_modes) + " normal modes, " +
                            std::to_string(r.static_shapes) + " static shapes, " +
                            std::to_string(r.removed_shapes) + " removed",
                        "frequencies [Hz] of the reduced body:"};
    for (std::size_t j = 0; j < r.frequencies.size(); ++j)
      result_.comments.push_back("  " + std::to_string(j + 1) + "  " + shown(r.frequencies[j]));
  }

  const FeModel& original_;
  const ReductionOptions& options_;
  const ReductionProgress& progress_;
  std::optional<FeModel> lumped_model_;
  const FeModel* model_ = &original_;  ///< with the mass in use
  Vec3 center_ = Vec3::Zero();         ///< of the mass in use
  MatX lumped_;
  std::vector<int> nodes_;  ///< in the file
  std::unique_ptr<BasisBuilder> builder_;
  MatX shapes_;
  VecX squares_;
  ReductionReport report_;
  Reduction result_;
};

constexpr const char* kBasisNames[] = {"free",       "constrained",    "craig-bampton",
                                       "complement", "inertia-relief", "inertia-decoupling"};

}  // namespace

const char* basis_name(ReductionBasis basis) { return kBasisNames[static_cast<int>(basis)]; }

ReductionBasis parse_basis(const std::string& name) {
  for (int k = 0; k < 6; ++k)
    if (name == kBasisNames[k]) return static_cast<ReductionBasis>(k);
  std::string accepted;
  for (const char* word : kBasisNames) accepted += std::string(accepted.empty() ? "" : ", ") + word;
  refuse_reduction("unknown basis `" + name + "`", "accepted: " + accepted);
}

Result<Reduction> reduce(const FeModel& model, const ReductionOptions& options,
                         const ReductionProgress& progress) {
  try {
    return Reducer(model, options, progress).run();
  } catch (const ReductionError& e) {
    return make_error(e.kind, "", e.what());
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::limit, "LIMIT_MEMORY",
                      "the reduction needs more memory than there is");
  }
}

}  // namespace mbcosim
