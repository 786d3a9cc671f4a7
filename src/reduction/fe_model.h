/// A finite element model as matrices: M ẍ + K x = f, with the nodes that its rows belong to.
#pragma once

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "math/types.h"
#include "reduction/matrix_market.h"

namespace mbcosim {

/// What a row of the matrices is: component 0 to 5 of a node, ux uy uz rx ry rz.
struct FeDof {
  int node = 0, component = 0;
};

struct FeModel {
  std::vector<std::string> labels;  ///< of the nodes
  MatX positions;                   ///< (3 × nodes) [m]
  std::vector<FeDof> dofs;          ///< of each row
  SparseMatrix mass, stiffness;     ///< both halves
  std::vector<char> supported;      ///< rows held to the ground

  int rows() const { return static_cast<int>(dofs.size()); }
  /// Index of a node; throws ReductionError when there is none.
  int node(const std::string& label) const;
  /// Row of a component of a node, -1 when the model has none.
  int row(int node, int component) const;
  std::vector<int> rows_of(int node) const;
  /// "node 17, ry"
  std::string dof_text(int row) const;
  /// Columns: unit translations along and rotations about the axes through `point` (rows × 6).
  MatX rigid_shapes(const Vec3& point) const;

  std::unordered_map<std::string, int> index;  ///< of node labels
  std::vector<std::array<int, 6>> row_of;      ///< by node
};

/// Texts of the input files; `dofs` and `supports` may be empty.
struct FeModelFiles {
  std::string mass, stiffness;  ///< Matrix Market
  std::string nodes;            ///< lines `label,x,y,z`
  std::string dofs;      ///< lines `label,component (1 to 6)`, one a row; none: 6 rows a node
  std::string supports;  ///< lines `label,components`, e.g. `7,123456`
};

/// Parses and checks. Throws ReductionError.
FeModel make_fe_model(const FeModelFiles& files);
/// Checks the parts of a model made in memory and builds its tables.
FeModel make_fe_model(std::vector<std::string> labels, MatX positions, std::vector<FeDof> dofs,
                      SparseMatrix mass, SparseMatrix stiffness);
/// Components (0 to 5) written as digits 1 to 6, "135".
std::vector<int> parse_components(const std::string& digits);

}  // namespace mbcosim
