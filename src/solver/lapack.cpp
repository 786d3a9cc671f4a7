#include "solver/lapack.h"

#include <dlfcn.h>

#include <string>
#include <type_traits>

namespace mbcosim {

namespace {

struct Loaded {
  Lapack functions;
  std::string problem;  ///< why one is missing; empty when none is
};

Loaded load() {
  Loaded result;
  void* const library = dlopen("liblapack.so.3", RTLD_LAZY | RTLD_LOCAL);
  if (!library) {
    result.problem = dlerror();
    return result;
  }
  const auto find = [&](auto*& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
    if (!function) result.problem = dlerror();
  };
  find(result.functions.dggevx, "dggevx_");
  find(result.functions.dlaqps, "dlaqps_");
  find(result.functions.dlaqp2, "dlaqp2_");
  return result;
}

}  // namespace

Result<const Lapack*> Lapack::get() {
  static const Loaded loaded = load();
  if (!loaded.problem.empty())
    return make_error(ErrorKind::io, "EIGENANALYSIS_FAILED",
                      "eigenanalysis: LAPACK cannot be loaded (Debian's package is liblapack3): " +
                          loaded.problem);
  return &loaded.functions;
}

}  // namespace mbcosim
