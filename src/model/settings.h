/// Settings of the `initial value` and `control data` blocks, with MBDyn's defaults
/// (MBDyn input manual).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "math/rotation.h"
#include "model/fwd.h"

namespace mbcosim {

enum class Method { crank_nicolson, multistep, hope, third_order, third_order_ad_hoc, bdf1 };

struct MethodSettings {
  Method method = Method::multistep;
  DrivePtr rho, rho_algebraic;  ///< null: 0
};

enum class ResidualTest { none, norm, minmax };
enum class StepStrategy { no_change, factor, change };

struct LineSearchSettings {
  double tolerance_x = 1e-7, tolerance_min = 1e-8, alpha = 1e-4, lambda_min = 1e-2,
         lambda_factor_min = 0.1, max_step = 100, divergence_factor = 1, min_scale = 1e-3;
  int max_iterations = 200;
  bool lambda_min_relative = true, zero_gradient_continue = false, divergence_check = true,
       cubic = true, scale_newton_step = true, abort_at_lambda_min = true;
};

struct EigenSettings {
  std::vector<double> times;
  double parameter = 1;
  bool matrices_full = false, matrices_sparse = false, eigenvectors = false, geometry = false;
  int matrix_precision = 0, results_precision = 0;    ///< 0: that of all results
  double lower_frequency = -1, upper_frequency = -1;  ///< [Hz], negative: no limit
  enum class Solver { unnamed, lapack, arpack, jdqz } solver = Solver::unnamed;
  enum class Balance { no, permute, all } balance = Balance::permute;
  int nev = 0, ncv = 0;
  double tolerance = 0;
  int suffix_width = -1;               ///< -1: compute
  std::string suffix_format = "%0*d";  ///< as SuffixFormat reads it

  bool is_dense() const { return solver == Solver::unnamed || solver == Solver::lapack; }
  /// Sparse matrices are for other programs: alone they are all that is wanted.
  bool finds_modes() const { return !matrices_sparse || eigenvectors || solver != Solver::unnamed; }
  /// Else the table of the run log is all.
  bool has_file() const { return matrices_full || matrices_sparse || eigenvectors || geometry; }
};

struct InitialValueSettings {
  double initial_time = 0;   ///< [s]
  double final_time = 0;     ///< [s]; infinity for `forever`
  double time_step = 1;      ///< [s]
  double min_time_step = 0;  ///< 0: none
  DrivePtr max_time_step;    ///< null: unlimited
  StepStrategy strategy = StepStrategy::no_change;
  DrivePtr strategy_change;
  double reduction = 0.5, raise = 1;
  int steps_before_reduction = 1, steps_before_raise = 1, min_iterations = 1,
      max_iterations_factor = 0;

  double tolerance = 1e-6, solution_tolerance = 0;
  ResidualTest residual_test = ResidualTest::norm, solution_test = ResidualTest::none;
  bool scale_residual = false, modify_residual_test = false;
  int max_iterations = 1;
  bool at_most = false;
  double max_residual = 0, max_residual_differential = 0;  ///< 0: no limit
  bool constraint_violations = false;  ///< `enforce constraint equations: constraint violations`
  double constraint_scale = 0;         ///< 0: 1/time step

  double derivatives_tolerance = 1e-6;
  int derivatives_max_iterations = 1;
  double derivatives_coefficient = 1e-6;  ///< times the time step
  bool derivatives_auto = false;
  int derivatives_auto_iterations = 6;
  double derivatives_auto_factor = 10;

  int dummy_steps = 0;
  double dummy_ratio = 1e-3, dummy_tolerance = 1e-6;
  int dummy_max_iterations = 1;
  std::optional<MethodSettings> dummy_method;
  MethodSettings method;

  bool modified_newton = false;
  int jacobian_every = 1;  ///< iterations between Jacobians (modified Newton)
  bool keep_jacobian = false;
  std::optional<LineSearchSettings> line_search;

  enum class AbortAfter {
    never,
    input,
    assembly,
    derivatives,
    dummy_steps
  } abort_after = AbortAfter::never;
  bool messages = true;  ///< `.out` tells of the derivatives phase, the dummy steps and each step
  std::optional<EigenSettings> eigenanalysis;  ///< of the last card

  /// Do results depend on how many iterations a step takes?
  bool iterations_count() const { return at_most || strategy == StepStrategy::factor; }
};

struct ControlSettings {
  bool skip_assembly = false, assemble_forces = false;
  double assembly_tolerance = 1e-6;
  int assembly_max_iterations = 1;
  double assembly_epsilon = 1;
  double position_stiffness = 1, velocity_stiffness = 1;
  bool omega_rotates = false;

  int output_frequency = 1;
  DrivePtr output_meter;  ///< overrides the frequency when set
  int output_precision = 6;
  OrientationDescription orientation = OrientationDescription::euler123;
  bool output_reference_frames = false, output_drives = false;
  bool netcdf = false;
  bool is_static = false;  ///< `model: static`
};

}  // namespace mbcosim
