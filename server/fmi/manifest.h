/// What the exporter tells the engine inside an FMU: `resources/mbcosim.json`.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "input/value.h"
#include "model/diagnostic.h"

namespace mbcosim::fmi {

/// One variable of modelDescription.xml.
struct FmuVariable {
  enum class Role { independent, input, output, tunable };  ///< tunable: a parameter
  enum class Source {
    variable,           ///< of the simulation, by name
    positions,          ///< of the points of a structural port, by its name: x (points × 3)
    orientations,       ///< R by rows (points × 3 × 3)
    velocities,         ///< v (points × 3)
    angular_velocities  ///< ω (points × 3)
  };
  std::uint32_t reference = 0;
  Role role = Role::output;
  Source source = Source::variable;
  std::string name;           ///< of the source
  std::vector<int> elements;  ///< which numbers of the source (size)
  std::vector<double> start;  ///< inputs and parameters (size)

  int size() const { return static_cast<int>(elements.size()); }
};

/// A fixed parameter: a symbol of the deck (`set` card), read when initialization ends.
struct FmuSymbol {
  std::uint32_t reference = 0;
  std::string name;    ///< in the deck
  Value start;         ///< its alternative is the type
  bool given = false;  ///< `start` was chosen at the export; else the deck gives it
};

struct Manifest {
  std::string token;                         ///< instantiationToken, guid
  std::string deck;                          ///< name of the main file
  std::string digest;                        ///< of the model, 16 hexadecimal digits
  std::map<std::string, std::string> files;  ///< name that the deck uses -> path below resources
  std::vector<FmuVariable> variables;
  std::vector<FmuSymbol> symbols;
  std::string remote;  ///< HTTP door of the daemon that takes the steps; empty: the engine inside
  double remote_timeout = 60;  ///< longest wait for it [s]
};

std::string to_json(const Manifest& manifest);
/// ErrorKind::data_loss when the text is no manifest.
Result<Manifest> manifest_from_json(const std::string& text);

}  // namespace mbcosim::fmi
