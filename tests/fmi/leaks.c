/* Uses an FMU again and again, as programs that check memory want it: LIBRARY RESOURCES TOKEN
   STANDARD REFERENCE CYCLES. RESOURCES is FMI 2's URI or FMI 3's path, REFERENCE that of the
   numbers {0, -1e4} with which a step of 0.1 s from the start fails (FMI 2: of the second one). One
   thread, then eight at once, then instances that are freed during a step; what the C library has
   handed out must not grow. */
#include <dlfcn.h>
#include <malloc.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kOk = 0, kDiscard = 2, kError = 3, kThreads = 8, kRounds = 4, kWarmUp = 3, kNoise = 16384 };

typedef struct {
  void (*logger)(void*, const char*, int, const char*, const char*, ...);
  void* (*allocate)(size_t, size_t);
  void (*release)(void*);
  void (*finished)(void*, int);
  void* environment;
} Callbacks2;

static struct {
  const char *resources, *token;
  bool two;
  uint32_t reference;
  int cycles;
  void *instantiate, *setup, *enter, *set, *step;
  int (*exit)(void*);
  int (*reset)(void*);
  int (*log)(void*, int, size_t, const char* const*);
  int (*wrong)(void*);
  void (*release)(void*);
  int (*get_state)(void*, void**);
  int (*set_state)(void*, void*);
  int (*free_state)(void*, void**);
  int (*size)(void*, void*, size_t*);
  int (*serialize)(void*, void*, char*, size_t);
  int (*deserialize)(void*, const char*, size_t, void**);
} fmu;

static void check(bool good, const char* what) {
  if (good) return;
  fprintf(stderr, "failed: %s\n", what);
  exit(1);
}

/* ------------------------------------------------------------------ what differs between the
 * standards */

static void* find(void* library, const char* two, const char* three) {
  void* symbol = dlsym(library, fmu.two ? two : three);
  check(symbol != NULL, fmu.two ? two : three);
  return symbol;
}

static void load(const char* path) {
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) fprintf(stderr, "%s\n", dlerror());
  check(library != NULL, "to load the FMU");
  fmu.instantiate = find(library, "fmi2Instantiate", "fmi3InstantiateCoSimulation");
  fmu.setup = fmu.two ? find(library, "fmi2SetupExperiment", "") : NULL;
  fmu.enter = find(library, "fmi2EnterInitializationMode", "fmi3EnterInitializationMode");
  fmu.set = find(library, "fmi2SetReal", "fmi3SetFloat64");
  fmu.step = find(library, "fmi2DoStep", "fmi3DoStep");
  *(void**)&fmu.exit = find(library, "fmi2ExitInitializationMode", "fmi3ExitInitializationMode");
  *(void**)&fmu.reset = find(library, "fmi2Reset", "fmi3Reset");
  *(void**)&fmu.log = find(library, "fmi2SetDebugLogging", "fmi3SetDebugLogging");
  *(void**)&fmu.wrong = find(library, "fmi2EnterEventMode", "fmi3EnterEventMode");
  *(void**)&fmu.release = find(library, "fmi2FreeInstance", "fmi3FreeInstance");
  *(void**)&fmu.get_state = find(library, "fmi2GetFMUstate", "fmi3GetFMUState");
  *(void**)&fmu.set_state = find(library, "fmi2SetFMUstate", "fmi3SetFMUState");
  *(void**)&fmu.free_state = find(library, "fmi2FreeFMUstate", "fmi3FreeFMUState");
  *(void**)&fmu.size = find(library, "fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize");
  *(void**)&fmu.serialize = find(library, "fmi2SerializeFMUstate", "fmi3SerializeFMUState");
  *(void**)&fmu.deserialize = find(library, "fmi2DeSerializeFMUstate", "fmi3DeserializeFMUState");
}

static void log_two(void* environment, const char* name, int status, const char* category,
                    const char* text, ...) {
  (void)environment, (void)name, (void)status, (void)category, (void)text;
}
static void log_three(void* environment, int status, const char* category, const char* text) {
  (void)environment, (void)status, (void)category, (void)text;
}

static void* make(const char* token) {
  static const Callbacks2 callbacks = {log_two, calloc, free, NULL, NULL};
  if (fmu.two)
    return ((void* (*)(const char*, int, const char*, const char*, const Callbacks2*, int,
                       int))fmu.instantiate)("again", 1, token, fmu.resources, &callbacks, 0, 1);
  return ((void* (*)(const char*, const char*, const char*, bool, bool, bool, bool, const uint32_t*,
                     size_t, void*, void (*)(void*, int, const char*, const char*),
                     void*))fmu.instantiate)("again", token, fmu.resources, false, true, false,
                                             false, NULL, 0, NULL, log_three, NULL);
}

static int enter(void* instance) {
  if (!fmu.two)
    return ((int (*)(void*, bool, double, double, bool, double))fmu.enter)(instance, false, 0, 0,
                                                                           false, 0);
  const int status =
      ((int (*)(void*, int, double, double, int, double))fmu.setup)(instance, 0, 0, 0, 0, 0);
  return status == kOk ? ((int (*)(void*))fmu.enter)(instance) : status;
}

static int push(void* instance) {
  const double values[2] = {0, -1e4};
  if (fmu.two)
    return ((int (*)(void*, const uint32_t*, size_t, const double*))fmu.set)(
        instance, &fmu.reference, 1, values + 1);
  return ((int (*)(void*, const uint32_t*, size_t, const double*, size_t))fmu.set)(
      instance, &fmu.reference, 1, values, 2);
}

static int step(void* instance, double time, double length) {
  if (fmu.two) return ((int (*)(void*, double, double, int))fmu.step)(instance, time, length, 0);
  bool event, terminate, early;
  double last;
  return ((int (*)(void*, double, double, bool, bool*, bool*, bool*, double*))fmu.step)(
      instance, time, length, false, &event, &terminate, &early, &last);
}

/* ------------------------------------------------------------------ what is done again and again
 */

static void initialize(void* instance) {
  check(enter(instance) == kOk && fmu.exit(instance) == kOk, "to initialize");
}

static void carry_state(void* instance, void* state) {
  void* copy = NULL;
  size_t size = 0;
  check(fmu.size(instance, state, &size) == kOk && size > 0, "the size of a state");
  char* bytes = malloc(size);
  check(bytes && fmu.serialize(instance, state, bytes, size) == kOk, "to serialize");
  check(fmu.deserialize(instance, bytes, size, &copy) == kOk, "to deserialize");
  check(fmu.set_state(instance, copy) == kOk && fmu.free_state(instance, &copy) == kOk,
        "to set a state");
  free(bytes);
}

static void cycle(void) {
  check(!make("of nobody"), "a wrong token");
  void *instance = make(fmu.token), *state = NULL;
  check(instance != NULL, "to instantiate");
  initialize(instance);
  check(fmu.get_state(instance, &state) == kOk, "to get a state");
  for (int k = 0; k < 5; ++k) check(step(instance, 0.01 * k, 0.01) == kOk, "a step");
  check(fmu.get_state(instance, &state) == kOk, "to replace a state");
  carry_state(instance, state);
  check(step(instance, 0.05, 0.013) == kOk, "a step of another length");
  check(fmu.reset(instance) == kOk, "to reset");
  initialize(instance);
  check(fmu.free_state(instance, &state) == kOk && fmu.get_state(instance, &state) == kOk,
        "to get a state again");
  check(push(instance) == kOk && step(instance, 0, 0.1) == kDiscard, "a step that is discarded");
  check(fmu.set_state(instance, state) == kOk && step(instance, 0, 0.1) == kOk,
        "a step after one that was discarded");
  check(fmu.free_state(instance, &state) == kOk, "to free a state");
  check(fmu.wrong(instance) == kError && fmu.reset(instance) == kOk &&
            step(instance, 0, 0.01) == kError,
        "calls out of order");
  fmu.release(instance);
}

static void* cycles(void* unused) {
  for (int k = 0; k < fmu.cycles; ++k) cycle();
  return unused;
}

static void in_threads(void) {
  pthread_t threads[kThreads];
  for (int k = 0; k < kThreads; ++k)
    check(pthread_create(&threads[k], NULL, cycles, NULL) == 0, "to start a thread");
  for (int k = 0; k < kThreads; ++k) check(pthread_join(threads[k], NULL) == 0, "to join a thread");
}

static atomic_bool ended;

/* Again when it was refused because the other thread had the instance. */
static void* long_step(void* instance) {
  int status = kError;
  while (status == kError) status = step(instance, 0, 20);
  ended = true;
  check(status == kOk, "the step of an instance that is freed");
  return NULL;
}

/* The log of an instance can be switched but while another call runs. */
static void free_at_work(void) {
  pthread_t thread;
  void* instance = make(fmu.token);
  check(instance != NULL, "to instantiate");
  initialize(instance);
  ended = false;
  check(pthread_create(&thread, NULL, long_step, instance) == 0, "to start a thread");
  while (fmu.log(instance, 1, 0, NULL) == kOk && !ended) {
  }
  fmu.release(instance);
  check(pthread_join(thread, NULL) == 0, "to join a thread");
}

static void freed_at_work(void) {
  for (int k = 0; k < 3; ++k) free_at_work();
}

/* What the C library keeps for threads comes and goes by some thousands of bytes, and a thread that
   has ended may still hold some: a leak grows every time. */
static void must_not_grow(void (*work)(void), const char* what) {
  size_t before = 0, after = kNoise;
  for (int k = 0; k < kWarmUp; ++k) work();
  for (int k = 0; k < kRounds && after >= before + kNoise; ++k) {
    before = mallinfo2().uordblks;
    work();
    after = mallinfo2().uordblks;
  }
  printf("%s: %zu bytes, then %zu\n", what, before, after);
  check(after < before + kNoise, "memory grows");
}

static void in_one(void) { cycles(NULL); }

int main(int count, char** arguments) {
  check(count == 7, "usage: LIBRARY RESOURCES TOKEN STANDARD REFERENCE CYCLES");
  fmu.resources = arguments[2];
  fmu.token = arguments[3];
  fmu.two = strcmp(arguments[4], "2") == 0;
  fmu.reference = (uint32_t)strtoul(arguments[5], NULL, 10);
  fmu.cycles = atoi(arguments[6]);
  load(arguments[1]);
  must_not_grow(in_one, "one thread");
  must_not_grow(in_threads, "eight threads");
  must_not_grow(freed_at_work, "freed at work");
  return 0;
}
