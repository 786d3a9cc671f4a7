/// Unknowns, equations and connections of a model (MBDyn input manual, control data, "Print").
#pragma once

#include <string>

#include "model/model.h"

namespace mbcosim {

/// What the card `print` asks for; empty without one.
std::string dof_text(const Model& model);
/// It belongs into PREFIX.dof, not onto the standard output.
bool has_dof_file(const Model& model);

}  // namespace mbcosim
