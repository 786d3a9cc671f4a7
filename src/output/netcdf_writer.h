/// Results as NetCDF: PREFIX.nc, one value of each variable per output record.
///
/// Variables: time, run.step, run.timestep; node.struct.<label>.X, .XP, ...;
/// elem.<type>.<label>.<field>; labels of each type in node.struct, elem.joint, ...; eig.<i>.* for
/// eigenanalyses. Names as in the MBDyn input manual, "NetCDF output".
#pragma once

#include <memory>
#include <string>

#include "output/result_budget.h"
#include "output/result_writer.h"

namespace mbcosim {

std::shared_ptr<ResultWriter> make_netcdf_writer(const std::string& prefix,
                                                 ResultBudget* budget = nullptr);

}  // namespace mbcosim
