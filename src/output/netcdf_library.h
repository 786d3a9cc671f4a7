/// The functions of the NetCDF library that are used, loaded when first needed: the library brings
/// some forty others along, whose linking would take most of the time of a short run.
#pragma once

#include <netcdf.h>

#include <string>

namespace mbcosim {

struct NetcdfLibrary {
  decltype(&::nc_create) create = nullptr;
  decltype(&::nc_open) open = nullptr;
  decltype(&::nc_sync) sync = nullptr;
  decltype(&::nc_close) close = nullptr;
  decltype(&::nc_inq_dimid) inq_dimid = nullptr;
  decltype(&::nc_inq_varid) inq_varid = nullptr;
  decltype(&::nc_redef) redef = nullptr;
  decltype(&::nc_enddef) enddef = nullptr;
  decltype(&::nc_def_dim) def_dim = nullptr;
  decltype(&::nc_def_var) def_var = nullptr;
  decltype(&::nc_put_att_text) put_att_text = nullptr;
  decltype(&::nc_put_var_int) put_var_int = nullptr;
  decltype(&::nc_put_var_double) put_var_double = nullptr;
  decltype(&::nc_put_var1_int) put_var1_int = nullptr;
  decltype(&::nc_put_vara_double) put_vara_double = nullptr;
  decltype(&::nc_strerror) strerror = nullptr;
  std::string problem;  ///< why it could not be loaded; empty when it could

  static const NetcdfLibrary& get();
};

}  // namespace mbcosim
