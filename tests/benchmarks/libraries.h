/// What programs that measure libraries share: the libraries are loaded when they run, so that a
/// build needs none.
#pragma once

#include <dlfcn.h>
#include <malloc.h>
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace mbcosim::benchmarks {

/// Of this process, user and system [s].
inline double processor_time() {
  rusage u;
  getrusage(RUSAGE_SELF, &u);
  return double(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
         1e-6 * double(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

/// Largest resident memory of this process.
inline long memory_mb() {
  rusage u;
  getrusage(RUSAGE_SELF, &u);
  return u.ru_maxrss / 1024;
}

/// Lets the largest memory begin with what is in use now (Linux, proc(5), clear_refs).
inline void forget_peak() {
  malloc_trim(0);
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w")) {
    std::fputs("5", file);
    std::fclose(file);
  }
}

[[noreturn]] inline void give_up(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::exit(1);
}

/// A function of a library by the type of its declaration.
template <class Function>
Function* loaded(const char* library, const char* name) {
  void* const handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  void* const function = handle ? dlsym(handle, name) : nullptr;
  if (!function) give_up(dlerror());
  return reinterpret_cast<Function*>(function);
}

/// One line of JSON.
class Report {
 public:
  void add(const char* name, double value) {
    std::printf("%s\"%s\": %.4g", first_ ? "{" : ", ", name, value);
    first_ = false;
  }
  template <class Work>
  void time(const char* name, const Work& work) {
    const double before = processor_time();
    work();
    add(name, processor_time() - before);
  }
  void end() const { std::printf("}\n"); }

 private:
  bool first_ = true;
};

}  // namespace mbcosim::benchmarks
