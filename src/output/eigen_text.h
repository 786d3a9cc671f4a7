/// Eigenanalyses as text: the table of the run log and the `.m` file for Octave.
#pragma once

#include <string>

#include "model/eigen_report.h"
#include "model/model.h"

namespace mbcosim {

/// Status line, header and one line per retained mode; empty when none were looked for.
std::string eigen_table(const EigenReport& report, int digits);
/// What stands between PREFIX and ".m": "_" and the position in the list of times, by the card's
/// format.
std::string eigen_suffix(const EigenSettings& settings, int index);
/// dTime, dCoef, and, as the card asks, Aplus, Aminus, labels, idx, X0, alpha, VR, VL.
std::string eigen_file(const EigenReport& report, const Model& model);

}  // namespace mbcosim
