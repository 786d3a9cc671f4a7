#include "fmi/modes.h"

#include <array>

namespace mbcosim::fmi {
namespace {

struct Row {
  Call call;
  const char* fmi2;  ///< one letter a mode, in the order of Mode; x: allowed
  const char* fmi3;
};

/// FMI 2.0.4, table of section 4.2.4; FMI 3.0.2, "Allowed Function Calls" of sections 2.3 and 4.2.
/// FMI 2 forbids to get a value after one was set and before the next step; importers do it all the
/// same to record what they set, and here the values are those of the last step.
constexpr std::array<Row, static_cast<int>(Call::count)> kTable = {{
    {Call::set_debug_logging, "xxxxxxx", "x.xx.x."},
    {Call::setup_experiment, "xx.....", "......."},
    {Call::enter_initialization, ".x.....", "x......"},
    {Call::exit_initialization, "..x....", "..x...."},
    {Call::terminate, "...xx..", "...x..."},
    {Call::reset, "xxxxxxx", "x.xx.x."},
    {Call::get, "..xxxxx", "x.xx.x."},
    {Call::set, "xxxx...", "x.xx..."},
    {Call::state, "xxxxxxx", "x.xx.x."},
    {Call::derivative, "..xxxxx", "..xx.x."},
    {Call::do_step, "...x...", "...x..."},
    {Call::step_status, "...xxx.", "......."},
}};

}  // namespace

bool is_allowed(Standard standard, Call call, Mode mode) {
  const Row& row = kTable[static_cast<int>(call)];
  return (standard == Standard::fmi2 ? row.fmi2 : row.fmi3)[static_cast<int>(mode)] == 'x';
}

const char* mode_name(Standard standard, Mode mode) {
  switch (mode) {
    case Mode::instantiated:
      return standard == Standard::fmi2 ? "Instantiated, before fmi2SetupExperiment"
                                        : "Instantiated";
    case Mode::set_up:
      return "Instantiated";
    case Mode::initialization:
      return "Initialization Mode";
    case Mode::step:
      return standard == Standard::fmi2 ? "step complete" : "Step Mode";
    case Mode::step_failed:
      return "step failed";
    case Mode::terminated:
      return "Terminated";
    case Mode::failed:
      return "error";
  }
  return "";
}

}  // namespace mbcosim::fmi
