#include "fmi/needed_libraries.h"

#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <filesystem>

namespace mbcosim::fmi {
namespace {

/// glibc's own; versions of it are never mixed.
constexpr std::array<const char*, 8> kOfTheSystem = {"libc.so",  "libm.so",      "libpthread.so",
                                                     "libdl.so", "librt.so",     "libmvec.so",
                                                     "ld-linux", "linux-vdso.so"};

/// A second namespace would have a second sanitizer, which ends the process. FMUs of such builds
/// are for tests on this machine, which has the libraries.
#ifdef MBCOSIM_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

bool is_of_the_system(const std::string& name) {
  return std::any_of(kOfTheSystem.begin(), kOfTheSystem.end(),
                     [&](const char* prefix) { return name.rfind(prefix, 0) == 0; });
}

}  // namespace

// A namespace of its own holds the library and what it needs, nothing of this program.
Result<std::map<std::string, std::string>> needed_libraries(const std::string& library) {
  std::map<std::string, std::string> needed;
  if (kSanitized) return needed;
  void* handle = ::dlmopen(LM_ID_NEWLM, library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  link_map* first = nullptr;
  if (!handle || ::dlinfo(handle, RTLD_DI_LINKMAP, &first) != 0)
    return make_error(ErrorKind::io, "",
                      std::string("cannot load the engine of the FMU: ") + ::dlerror());
  while (first->l_prev) first = first->l_prev;
  for (const link_map* each = first; each; each = each->l_next) {
    const std::filesystem::path path(each->l_name);
    const std::string name = path.filename().string();
    if (name.empty() || is_of_the_system(name) || std::filesystem::path(library).filename() == name)
      continue;
    needed[name] = path.string();
  }
  ::dlclose(handle);
  return needed;
}

}  // namespace mbcosim::fmi
