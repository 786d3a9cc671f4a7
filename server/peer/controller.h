/// A co-simulation FMU of FMI 2.0 or 3.0 that runs inside this process.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "peer/fmu_archive.h"

namespace mbcosim::peer {

/// What both standards have in common. Throws std::runtime_error when the FMU refuses.
class Controller {
 public:
  virtual ~Controller() = default;
  /// Initializes at a time [s].
  virtual void start(double time) = 0;
  virtual void set(const std::vector<std::uint32_t>& references,
                   const std::vector<double>& values) = 0;
  /// `size`: numbers of all of them.
  virtual std::vector<double> get(const std::vector<std::uint32_t>& references,
                                  std::size_t size) = 0;
  virtual void do_step(double time, double length) = 0;
  /// Keeps the state, instead of the one kept before; `restore` goes back to it.
  virtual void keep() = 0;
  virtual void restore() = 0;
};

/// Loads the library of the FMU and makes an instance.
std::unique_ptr<Controller> make_controller(const FmuArchive& archive);

}  // namespace mbcosim::peer
