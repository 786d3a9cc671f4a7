/// The `.log` file: the model as read, for post-processors (MBDyn input manual, log file).
#pragma once

#include <string>

#include "model/model.h"

namespace mbcosim {

/// Whole text of PREFIX.log.
std::string model_log(const Model& model);

}  // namespace mbcosim
