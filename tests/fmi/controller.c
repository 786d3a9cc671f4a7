/* A small FMU for tests of `mbcosim peer fmu`: y = gain * x with x' = u, by Euler's method in steps of 1 ms or less.
 * Compiled with -DFMI=2 or -DFMI=3; variables: u (0, input), y (1, output), gain (2, parameter). With FMI 3 also arrays: us (10, input) of three
 * numbers, x' = u + us[1] + 10 us[2] + 100 us[3], and ys (11, output) of two, y and 2 y. */
#include <ctype.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
  double u, x, gain, us[3];
} Model;

static int get(Model* m, const uint32_t* references, size_t count, double* values) {
  for (size_t k = 0; k < count; ++k) {
    if (references[k] > 2) return 3;
    values[k] = references[k] == 0 ? m->u : references[k] == 1 ? m->gain * m->x : m->gain;
  }
  return 0;
}

static int set(Model* m, const uint32_t* references, size_t count, const double* values) {
  for (size_t k = 0; k < count; ++k) {
    if (references[k] == 0)
      m->u = values[k];
    else if (references[k] == 2)
      m->gain = values[k];
    else
      return 3;
  }
  return 0;
}

static int step(Model* m, double length) {
  if (length <= 0) return 3;
  if (m->u > 1e6) return 2; /* as if it did not converge */
  int count = (int)(length / 1e-3) + 1;
  const double rate = m->u + m->us[0] + 10 * m->us[1] + 100 * m->us[2];
  for (int k = 0; k < count; ++k) m->x += rate * length / count;
  return 0;
}

static Model* make(void) {
  Model* m = calloc(1, sizeof *m);
  if (m) m->gain = 1;
  return m;
}

static int keep(Model* m, void** state) {
  if (!*state) *state = malloc(sizeof *m);
  if (!*state) return 3;
  *(Model*)*state = *m;
  return 0;
}

static int restore(Model* m, void* state) {
  if (!state) return 3;
  *m = *(Model*)state;
  return 0;
}

static int release(void** state) {
  free(*state);
  *state = NULL;
  return 0;
}

#if FMI == 2
/* Of RFC 3986: a path without anything that must be escaped. */
static bool is_file_uri(const char* text) {
  if (strncmp(text, "file:///", 8) != 0) return false;
  for (text += 8; *text; ++text) {
    if (isalnum((unsigned char)*text) || strchr("-._~/", *text)) continue;
    if (*text != '%' || !isxdigit((unsigned char)text[1]) || !isxdigit((unsigned char)text[2])) return false;
  }
  return true;
}

void* fmi2Instantiate(const char* a, int b, const char* c, const char* resources, const void* e, int f, int g) {
  (void)a, (void)b, (void)c, (void)e, (void)f, (void)g;
  return is_file_uri(resources) ? make() : NULL;
}
void fmi2FreeInstance(void* m) { free(m); }
int fmi2SetupExperiment(void* m, int a, double b, double c, int d, double e) {
  (void)a, (void)b, (void)c, (void)d, (void)e;
  return m ? 0 : 3;
}
int fmi2EnterInitializationMode(void* m) { return m ? 0 : 3; }
int fmi2ExitInitializationMode(void* m) { return m ? 0 : 3; }
int fmi2GetReal(void* m, const uint32_t* r, size_t n, double* v) { return get(m, r, n, v); }
int fmi2SetReal(void* m, const uint32_t* r, size_t n, const double* v) { return set(m, r, n, v); }
int fmi2DoStep(void* m, double t, double h, int a) {
  (void)t, (void)a;
  return step(m, h);
}
int fmi2GetFMUstate(void* m, void** s) { return keep(m, s); }
int fmi2SetFMUstate(void* m, void* s) { return restore(m, s); }
int fmi2FreeFMUstate(void* m, void** s) { return m ? release(s) : 3; }
#else
void* fmi3InstantiateCoSimulation(const char* a, const char* b, const char* c, bool d, bool e, bool f, bool g, const uint32_t* h,
                                  size_t i, void* j, void* k, void* l) {
  (void)a, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h, (void)i, (void)j, (void)k, (void)l;
  return make();
}
void fmi3FreeInstance(void* m) { free(m); }
int fmi3EnterInitializationMode(void* m, bool a, double b, double c, bool d, double e) {
  (void)a, (void)b, (void)c, (void)d, (void)e;
  return m ? 0 : 3;
}
int fmi3ExitInitializationMode(void* m) { return m ? 0 : 3; }
static size_t size_of(uint32_t reference) { return reference == 10 ? 3 : reference == 11 ? 2 : 1; }
int fmi3GetFloat64(void* handle, const uint32_t* r, size_t n, double* v, size_t s) {
  Model* m = handle;
  for (size_t k = 0; k < n; v += size_of(r[k]), s -= size_of(r[k]), ++k) {
    const double ys[] = {m->gain * m->x, 2 * m->gain * m->x};
    if (s < size_of(r[k])) return 3;
    if (r[k] == 10) memcpy(v, m->us, sizeof m->us);
    if (r[k] == 11) memcpy(v, ys, sizeof ys);
    if (size_of(r[k]) == 1 && get(m, r + k, 1, v) != 0) return 3;
  }
  return s == 0 ? 0 : 3;
}
int fmi3SetFloat64(void* handle, const uint32_t* r, size_t n, const double* v, size_t s) {
  Model* m = handle;
  for (size_t k = 0; k < n; v += size_of(r[k]), s -= size_of(r[k]), ++k) {
    if (s < size_of(r[k]) || r[k] == 11) return 3;
    if (r[k] == 10) memcpy(m->us, v, sizeof m->us);
    if (r[k] != 10 && set(m, r + k, 1, v) != 0) return 3;
  }
  return s == 0 ? 0 : 3;
}
int fmi3DoStep(void* m, double t, double h, bool a, bool* event, bool* terminate, bool* early, double* last) {
  (void)a;
  *event = *terminate = *early = false;
  *last = t + h;
  return step(m, h);
}
int fmi3GetFMUState(void* m, void** s) { return keep(m, s); }
int fmi3SetFMUState(void* m, void* s) { return restore(m, s); }
int fmi3FreeFMUState(void* m, void** s) { return m ? release(s) : 3; }
#endif
