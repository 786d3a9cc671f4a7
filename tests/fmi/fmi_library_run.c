/* Runs an FMU for co-simulation with FMI Library: FMU FOLDER STEPS NAME... prints the values of the variables at the start and after each step
   of the default experiment, in hexadecimal digits. FOLDER: where the FMU is unpacked. */
#include <fmilib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kMost = 512 };

static void log_message(jm_callbacks* c, jm_string module, jm_log_level_enu_t level, jm_string message) {
  (void)c;
  (void)level;
  fprintf(stderr, "%s: %s\n", module, message);
}

static void check(int failed, const char* what) {
  if (!failed) return;
  fprintf(stderr, "failed: %s\n", what);
  exit(1);
}

static void print(const double* values, size_t count) {
  for (size_t k = 0; k < count; ++k) printf("%a ", values[k]);
}

static void run2(fmi_import_context_t* context, int count, char** arguments) {
  static fmi2_callback_functions_t callbacks;
  fmi2_import_t* fmu = fmi2_import_parse_xml(context, arguments[2], 0);
  check(!fmu, "parse");
  callbacks.logger = fmi2_log_forwarding;
  callbacks.allocateMemory = calloc;
  callbacks.freeMemory = free;
  callbacks.componentEnvironment = fmu;
  check(fmi2_import_create_dllfmu(fmu, fmi2_fmu_kind_cs, &callbacks), "load");
  const double start = fmi2_import_get_default_experiment_start(fmu), step = fmi2_import_get_default_experiment_step(fmu);
  check(fmi2_import_instantiate(fmu, "instance", fmi2_cosimulation, NULL, fmi2_false), "instantiate");
  check(fmi2_import_setup_experiment(fmu, fmi2_false, 0, start, fmi2_false, 0), "setup");
  check(fmi2_import_enter_initialization_mode(fmu) || fmi2_import_exit_initialization_mode(fmu), "initialize");
  for (int k = 0; k <= atoi(arguments[3]); ++k) {
    check(k > 0 && fmi2_import_do_step(fmu, start + (k - 1) * step, step, fmi2_true), "step");
    for (int a = 4; a < count; ++a) {
      double value;
      fmi2_import_variable_t* variable = fmi2_import_get_variable_by_name(fmu, arguments[a]);
      check(!variable, arguments[a]);
      const fmi2_value_reference_t reference = fmi2_import_get_variable_vr(variable);
      check(fmi2_import_get_real(fmu, &reference, 1, &value), "get");
      print(&value, 1);
    }
    printf("\n");
  }
  check(fmi2_import_terminate(fmu), "terminate");
  fmi2_import_free_instance(fmu);
  fmi2_import_destroy_dllfmu(fmu);
  fmi2_import_free(fmu);
}

/* Arrays have three numbers. */
static void run3(fmi_import_context_t* context, int count, char** arguments) {
  fmi3_import_t* fmu = fmi3_import_parse_xml(context, arguments[2], 0);
  check(!fmu, "parse");
  check(fmi3_import_create_dllfmu(fmu, fmi3_fmu_kind_cs, NULL, NULL), "load");
  const double start = fmi3_import_get_default_experiment_start(fmu), step = fmi3_import_get_default_experiment_step_size(fmu);
  char resources[4096];
  snprintf(resources, sizeof resources, "%s/resources/", arguments[2]);
  check(fmi3_import_instantiate_co_simulation(fmu, "instance", resources, fmi3_false, fmi3_false, fmi3_false, fmi3_false, NULL, 0, NULL),
        "instantiate");
  check(fmi3_import_enter_initialization_mode(fmu, fmi3_false, 0, start, fmi3_false, 0) || fmi3_import_exit_initialization_mode(fmu),
        "initialize");
  for (int k = 0; k <= atoi(arguments[3]); ++k) {
    fmi3_boolean_t event, terminate, early;
    double last;
    check(k > 0 && fmi3_import_do_step(fmu, start + (k - 1) * step, step, fmi3_true, &event, &terminate, &early, &last), "step");
    for (int a = 4; a < count; ++a) {
      double values[3];
      fmi3_import_variable_t* variable = fmi3_import_get_variable_by_name(fmu, arguments[a]);
      check(!variable, arguments[a]);
      const fmi3_value_reference_t reference = fmi3_import_get_variable_vr(variable);
      check(fmi3_import_get_float64(fmu, &reference, 1, values, 3), "get");
      print(values, 3);
    }
    printf("\n");
  }
  check(fmi3_import_terminate(fmu), "terminate");
  fmi3_import_free_instance(fmu);
  fmi3_import_destroy_dllfmu(fmu);
  fmi3_import_free(fmu);
}

int main(int count, char** arguments) {
  check(count < 5 || count > kMost, "usage: FMU FOLDER STEPS NAME...");
  jm_callbacks callbacks;
  memset(&callbacks, 0, sizeof callbacks);
  callbacks.malloc = malloc;
  callbacks.calloc = calloc;
  callbacks.realloc = realloc;
  callbacks.free = free;
  callbacks.logger = log_message;
  callbacks.log_level = jm_log_level_warning;
  fmi_import_context_t* context = fmi_import_allocate_context(&callbacks);
  const fmi_version_enu_t version = fmi_import_get_fmi_version(context, arguments[1], arguments[2]);
  check(version != fmi_version_2_0_enu && version != fmi_version_3_0_enu, "version");
  (version == fmi_version_2_0_enu ? run2 : run3)(context, count, arguments);
  fmi_import_free_context(context);
  return 0;
}
