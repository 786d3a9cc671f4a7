#pragma once

namespace mbcosim {

/// `output results: netcdf, sync`: a ModelPart.
struct NetcdfSync {
  bool on = false;  ///< each record can be read as soon as it is written
};

}  // namespace mbcosim
