/// The `.log` file: the model as read, for post-processors. Spec 02 section 11.3.
#pragma once

#include <string>

#include "model/model.h"

namespace mbcosim {

/// Whole text of PREFIX.log.
std::string model_log(const Model& model);

}  // namespace mbcosim
