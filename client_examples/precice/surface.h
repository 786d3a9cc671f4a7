/// The points of a port as a mesh of preCICE.
#pragma once

#include <mutex>
#include <precice/precice.hpp>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "options.h"

/// Holds what crosses the port: gives the peer's thread the loads that preCICE has for the time of
/// each exchange, and preCICE the motion of the last one. During a step only the peer's thread uses
/// preCICE, else only the thread that steps.
class Surface {
 public:
  /// Makes the mesh. `start`: the motion from which displacements count.
  Surface(precice::Participant& participant, const Options& options,
          const mbcosim::client::Motion& start);

  /// A step begins at `time` of the simulation, and ends `length` [s] later in preCICE's.
  void begin_step(double time, double length);
  /// The peer's answer. A tight exchange: the last one of a step is at the accepted state.
  mbcosim::client::Loads answer(const mbcosim::client::Motion& motion);
  /// Writes the last motion.
  void write();

 private:
  /// `after` the start of the step [s], (3n). Throws when a number is not finite.
  std::vector<double> read(const std::string& data, double after);
  void write(const std::string& data, const std::vector<double>& values);

  precice::Participant& participant_;
  const std::string mesh_;
  const DataNames data_;
  const std::size_t dimensions_;        ///< 2: in the plane of x and y
  const std::vector<double> start_;     ///< positions (3n) [m]
  std::vector<precice::VertexID> ids_;  ///< (n)
  std::mutex mutex_;                    ///< of all below
  mbcosim::client::Motion motion_;
  double step_start_ = 0;   ///< [s]
  double step_length_ = 0;  ///< [s]
};
