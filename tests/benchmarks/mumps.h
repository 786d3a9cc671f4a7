/// MUMPS on one process, where its headers are.
#pragma once

#if __has_include(<dmumps_c.h>)
#include <dmumps_c.h>

#include <cstring>

#include "libraries.h"

#define HAS_MUMPS

namespace mbcosim::benchmarks {

class Mumps {
 public:
  /// `symmetry`: 0 none, 1 positive definite.
  explicit Mumps(int symmetry) {
    std::memset(&id, 0, sizeof id);
    id.par = 1;
    id.sym = symmetry;
    id.comm_fortran = -987654;
    run(-1);
    for (int k = 0; k < 4; ++k) id.icntl[k] = 0;  // prints nothing
    id.nrhs = 1;
  }
  ~Mumps() { run(-2); }
  Mumps(const Mumps&) = delete;
  Mumps& operator=(const Mumps&) = delete;

  void run(int job) {
    id.job = job;
    call_(&id);
    if (id.infog[0] < 0) give_up("MUMPS: error " + std::to_string(id.infog[0]));
  }

  DMUMPS_STRUC_C id;

 private:
  void (*const call_)(DMUMPS_STRUC_C*) = loaded<void(DMUMPS_STRUC_C*)>("libdmumps_seq-5.5.so",
                                                                       "dmumps_c");
};

}  // namespace mbcosim::benchmarks
#endif
