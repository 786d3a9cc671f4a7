#pragma once

namespace mbcosim {

/// The items of the control data's card `print`: a ModelPart.
struct PrintedDofs {
  bool statistics = false, dofs = false, equations = false;  ///< the latter two: descriptions
  bool element_connections = false, node_connections = false;
  bool to_file = false;  ///< PREFIX.dof, else the standard output
};

}  // namespace mbcosim
