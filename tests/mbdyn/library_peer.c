/* A code for decks with external forces, on the public interface of MBDyn's client library. Loads
 * are linear in what is received, so that every field counts: force   -3 x - 0.5 v - 0.01 a moment
 * 0.01 (first three numbers of the rotation) - 0.02 w - 0.001 w' library_peer PATH KIND COUNT
 * LABELS ROTATION ACCELERATIONS REFERENCE ITERATIONS KIND nodal or modal; COUNT points or modes;
 * ROTATION, REFERENCE: flags of the library, 0 none; ITERATIONS of a step, 0: never the last one */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mbc.h"

static void load(double* f, double* m, const double* x, const double* rotation, const double* v,
                 const double* w, const double* a, const double* wp) {
  for (int i = 0; i < 3; i++) {
    f[i] = -3.0 * x[i] - 0.5 * v[i] - (a ? 0.01 * a[i] : 0.0);
    if (m && rotation) m[i] = 0.01 * rotation[i] - 0.02 * w[i] - (wp ? 0.001 * wp[i] : 0.0);
  }
}

static const double* at(const double* numbers, int k, int size) {
  return numbers ? numbers + k * size : NULL;
}

static const double* rotation_of(unsigned form, const double* vector, const double* matrix,
                                 const double* angles) {
  return form == MBC_ROT_THETA       ? vector
         : form == MBC_ROT_MAT       ? matrix
         : form == MBC_ROT_EULER_123 ? angles
                                     : NULL;
}

static void load_reference(mbc_nodal_t* mbc) {
  const unsigned form = MBC_F_ROT_REF_NODE(mbc);
  const int accelerations = MBC_F_ACCELS(mbc) != 0;
  if (MBC_F_LABELS(mbc)) MBC_R_D_LABEL(mbc) = MBC_R_K_LABEL(mbc);
  load(MBC_R_F(mbc), form ? MBC_R_M(mbc) : NULL, MBC_R_X(mbc),
       rotation_of(form, MBC_R_THETA(mbc), MBC_R_R(mbc), MBC_R_EULER_123(mbc)), MBC_R_XP(mbc),
       MBC_R_OMEGA(mbc), accelerations ? MBC_R_XPP(mbc) : NULL,
       accelerations ? MBC_R_OMEGAP(mbc) : NULL);
}

static void load_points(mbc_nodal_t* mbc) {
  const unsigned form = MBC_F_ROT(mbc);
  const double* rotations = rotation_of(form, MBC_N_THETA(mbc), MBC_N_R(mbc), MBC_N_EULER_123(mbc));
  for (int k = 0; k < (int)mbc->nodes; k++) {
    if (MBC_F_LABELS(mbc)) MBC_N_D_LABELS(mbc)[k] = MBC_N_K_LABELS(mbc)[k];
    load(MBC_N_F(mbc) + 3 * k, form ? MBC_N_M(mbc) + 3 * k : NULL, at(MBC_N_X(mbc), k, 3),
         at(rotations, k, form == MBC_ROT_MAT ? 9 : 3), at(MBC_N_XP(mbc), k, 3),
         at(MBC_N_OMEGA(mbc), k, 3), at(MBC_N_XPP(mbc), k, 3), at(MBC_N_OMEGAP(mbc), k, 3));
  }
}

static int run_nodal(char** argv, int count, int iterations) {
  mbc_nodal_t mbc;
  memset(&mbc, 0, sizeof mbc);
  mbc.mbc.data_and_next = 1;
  mbc.mbc.timeout = 60;
  if (mbc_nodal_init(&mbc, atoi(argv[7]), count, atoi(argv[4]), atoi(argv[5]), atoi(argv[6])) != 0)
    return 2;
  if (mbc_unix_init((mbc_t*)&mbc, argv[1]) != 0 || mbc_nodal_negotiate_request(&mbc) != 0) return 3;
  for (int k = 1; mbc_nodal_get_motion(&mbc) == 0; k++) {
    if (MBC_F_REF_NODE(&mbc)) load_reference(&mbc);
    load_points(&mbc);
    if (mbc_nodal_put_forces(&mbc, iterations > 0 && k % iterations == 0) != 0) return 4;
  }
  return 0;
}

static int run_modal(char** argv, int count, int iterations) {
  mbc_modal_t mbc;
  memset(&mbc, 0, sizeof mbc);
  mbc.mbc.data_and_next = 1;
  mbc.mbc.timeout = 60;
  if (mbc_modal_init(&mbc, atoi(argv[7]), count) != 0) return 2;
  if (mbc_unix_init((mbc_t*)&mbc, argv[1]) != 0 || mbc_modal_negotiate_request(&mbc) != 0) return 3;
  for (int k = 1; mbc_modal_get_motion(&mbc) == 0; k++) {
    for (int i = 0; i < count; i++)
      MBC_P(&mbc)[i] = -3.0 * MBC_Q(&mbc)[i] - 0.5 * MBC_QP(&mbc)[i] + 0.1 * (i + 1);
    for (int i = 0; i < 3 && MBC_F_REF_NODE(&mbc); i++) {
      MBC_R_F(&mbc)[i] = -3.0 * MBC_R_X(&mbc)[i] - 0.5 * MBC_R_XP(&mbc)[i];
      MBC_R_M(&mbc)[i] = 0.01 * MBC_R_R(&mbc)[i] - 0.02 * MBC_R_OMEGA(&mbc)[i];
    }
    if (mbc_modal_put_forces(&mbc, iterations > 0 && k % iterations == 0) != 0) return 4;
  }
  return 0;
}

int main(int argc, char** argv) {
  if (argc != 9) return 1;
  const int count = atoi(argv[3]), iterations = atoi(argv[8]);
  return strcmp(argv[2], "modal") == 0 ? run_modal(argv, count, iterations)
                                       : run_nodal(argv, count, iterations);
}
