/// The result files that a deck asks for.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "output/result_budget.h"
#include "output/result_writer.h"

namespace mbcosim {

/// Text files, and PREFIX.nc with `output results: netcdf`.
std::shared_ptr<ResultWriter> make_result_writer(const Model& model, const std::string& prefix);

enum class ResultFormat { text, netcdf };
/// What `model` asks for.
std::vector<ResultFormat> result_formats(const Model& model);
/// Files of these formats, one of each at least; `budget`: of which their bytes are taken.
std::shared_ptr<ResultWriter> make_result_writer(const std::vector<ResultFormat>& formats,
                                                 const std::string& prefix, ResultBudget* budget);

}  // namespace mbcosim
