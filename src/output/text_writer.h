/// MBDyn's text result files: PREFIX.out, .log, .mov, .jnt, ... (its input manual, results).
#pragma once

#include <memory>
#include <string>

#include "output/result_budget.h"
#include "output/result_writer.h"

namespace mbcosim {

/// Files are created when their first line is written, except .out and .log.
std::shared_ptr<ResultWriter> make_text_writer(const std::string& prefix,
                                               ResultBudget* budget = nullptr);

}  // namespace mbcosim
