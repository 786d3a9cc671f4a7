#include "output/netcdf_library.h"

#include <dlfcn.h>

namespace mbcosim {

namespace {

NetcdfLibrary load() {
  NetcdfLibrary n;
  void* const library = dlopen(MBCOSIM_NETCDF_LIBRARY, RTLD_LAZY | RTLD_LOCAL);
  const auto find = [&](auto& function, const char* name) {
    if (n.problem.empty())
      function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
    if (!function && n.problem.empty())
      n.problem = std::string(MBCOSIM_NETCDF_LIBRARY) + " has no function " + name;
  };
  if (!library) n.problem = dlerror();
  find(n.create, "nc_create");
  find(n.open, "nc_open");
  find(n.sync, "nc_sync");
  find(n.close, "nc_close");
  find(n.inq_dimid, "nc_inq_dimid");
  find(n.inq_varid, "nc_inq_varid");
  find(n.redef, "nc_redef");
  find(n.enddef, "nc_enddef");
  find(n.def_dim, "nc_def_dim");
  find(n.def_var, "nc_def_var");
  find(n.put_att_text, "nc_put_att_text");
  find(n.put_var_int, "nc_put_var_int");
  find(n.put_var_double, "nc_put_var_double");
  find(n.put_var1_int, "nc_put_var1_int");
  find(n.put_vara_double, "nc_put_vara_double");
  find(n.strerror, "nc_strerror");
  return n;
}

}  // namespace

const NetcdfLibrary& NetcdfLibrary::get() {
  static const NetcdfLibrary library = load();
  return library;
}

}  // namespace mbcosim
