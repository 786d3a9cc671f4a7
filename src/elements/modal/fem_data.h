/// FEM data files: shapes, modal matrices and inertia of a flexible body, in numbered record groups
/// (text) or packed (binary).
///
/// Source: MBDyn input manual, modal joint, "FEM data".
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "math/types.h"
#include "model/diagnostic.h"

namespace mbcosim {

/// Group 12: rigid-body inertia, axes of the FEM frame.
struct FemRigidInertia {
  double mass = 0;              ///< [kg]
  Vec3 center = Vec3::Zero();   ///< centre of mass [m]
  Mat3 inertia = Mat3::Zero();  ///< about the centre of mass [kg·m²]
};

/// What one FEM data file holds; N nodes, n modes (rejected ones are gone). Units are those of the
/// file.
struct FemData {
  std::string name;      ///< of the file, for messages
  std::string revision;  ///< first word of group 1
  bool binary = false;
  int normal = 0, attached = 0, constraint = 0, rejected = 0;  ///< mode counts of group 1
  std::vector<std::string> labels;                             ///< group 2 (N)
  VecX initial_amplitudes, initial_velocities;  ///< groups 3 and 4 (n), zero when absent
  MatX positions;                               ///< groups 5 to 7 (3 × N)
  MatX shapes;                           ///< group 8 (6N × n); rows of a node: ux uy uz rx ry rz
  MatX mass, stiffness;                  ///< groups 9 and 10 (n × n)
  std::optional<MatX> lumped;            ///< group 11 (6 × N): mx my mz Jx Jy Jz of each node
  std::optional<FemRigidInertia> rigid;  ///< group 12
  std::optional<MatX> damping;           ///< group 13 (n × n)
  std::vector<int> groups;               ///< in the order met
  std::vector<Diagnostic> notes;         ///< warnings

  int node_count() const { return static_cast<int>(labels.size()); }
  int mode_count() const { return static_cast<int>(mass.rows()); }
  /// Index of a node label, -1 when the file lacks it.
  int find_node(std::string_view label) const;
};

/// Parses the bytes of a FEM data file, text or binary (recognized by its first bytes). `name` is
/// used in messages. Throws DeckError with line and group when the data are incomplete or would
/// silently be wrong; counts are checked against the size of the file before memory is taken.
FemData parse_fem_data(const std::string& name, std::string_view bytes);

/// The file as text, 17 significant digits; `comments` are written first, each on a line of its
/// own.
std::string write_fem_text(const FemData& data, const std::vector<std::string>& comments);
/// The file in the packed form.
std::string write_fem_binary(const FemData& data);

namespace detail {
FemData parse_fem_text(const std::string& name, std::string_view text);
FemData parse_fem_binary(const std::string& name, std::string_view bytes);
[[noreturn]] void refuse_fem_data(const std::string& name, int line, const std::string& message,
                                  const std::string& hint = "");
/// Refuses a group that is not read: 14 to 19 hold what newer programs compute from group 11.
[[noreturn]] void refuse_fem_group(const std::string& name, int line, int group);
/// Checks that hold for either form: values finite, labels distinct, inertia not negative.
void check_fem_data(FemData& data);
void note_fem_data(FemData& data, int line, const std::string& message,
                   const std::string& hint = "");
}  // namespace detail

}  // namespace mbcosim
