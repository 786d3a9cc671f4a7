/// From a deck to an FMU.
#pragma once

#include <string>
#include <vector>

#include "fmi/catalogue.h"
#include "fmi/status.h"
#include "model/diagnostic.h"

namespace mbcosim::fmi {

struct ExportOptions {
  std::string deck;    ///< path of the main file
  std::string output;  ///< path of the FMU
  Standard standard = Standard::fmi3;
  Selection selection;
  SymbolValues symbols;        ///< instead of what the deck gives them
  std::string remote;          ///< HTTP door of a daemon; empty: the engine inside
  double remote_timeout = 60;  ///< [s]
  std::string library;         ///< path of the shared library with the engine
};

struct ExportReport {
  std::vector<Diagnostic> diagnostics;  ///< of the deck
  int inputs = 0, outputs = 0, parameters = 0;
};

/// ErrorKind::deck when the deck is refused; `report` has its diagnostics then, too.
mbcosim::Status export_fmu(const ExportOptions& options, ExportReport& report);

}  // namespace mbcosim::fmi
