/// The result files that a deck asks for.
#pragma once

#include <memory>
#include <string>

#include "output/result_writer.h"

namespace mbcosim {

/// Text files, and PREFIX.nc with `output results: netcdf`.
std::shared_ptr<ResultWriter> make_result_writer(const Model& model, const std::string& prefix);

}  // namespace mbcosim
