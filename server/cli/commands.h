/// The subcommands of `mbcosim`, each in its own file. They link the engine alone.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "input/symbols.h"

namespace mbcosim::cli {

/// Exit codes of `mbcosim`, the same for every subcommand.
enum ExitCode {
  kDone = 0,
  kDiffer = 1,
  kDeckRefused = 2,
  kNumericalFailure = 3,
  kRefused = 4,
  kPeerLost = 5,
  kInternalError = 6,  ///< a mistake of this program
  kInterrupted = 130
};

constexpr int kMostThreads = 1024;

struct RunOptions {
  std::string deck;  ///< path of the main file
  SymbolValues symbols;
  std::string
      prefix;  ///< of the result files, or their folder; empty: the deck's path without ending
  std::vector<std::string> formats;  ///< "text", "netcdf"; empty: what the deck asks for
  bool quiet = false;
  bool deck_sockets = true;  ///< the sockets and files that the deck names are served
  double peer_timeout = 60;  ///< longest wait for a code behind them [s]
  bool pads_labels = false;  ///< the codes pad labels of an odd number of points
  bool real_time = false;    ///< a second of the model lasts a second
  int threads = 0;           ///< 0: as many as there are
};

struct ReduceCommand {
  std::string job;     ///< file of lines `name = value`; may be empty
  std::string output;  ///< FEM data file
  bool quiet = false;
  int threads = 0;                                           ///< 0: as many as there are
  std::vector<std::pair<std::string, std::string>> options;  ///< of the command line
};

/// Columns of a result file to draw.
struct CurveRequest {
  std::string ending;  ///< "mov", "jnt", …
  int label = 0;
  std::string quantity;  ///< a word for columns, or the number of one, from 1
};

struct PlotCommand {
  std::string prefix;  ///< of the result files
  std::vector<CurveRequest> curves;
  std::string picture;  ///< file to write; empty: the terminal
};

struct DiffCommand {
  std::string first, second;  ///< prefixes of result files
  double relative = 1e-6;     ///< tolerance, of the largest value of a column
  double absolute = 0;        ///< differences up to this one do not count
};

struct EigCommand {
  std::string deck;
  SymbolValues symbols;
  int count = 0;                    ///< eigenvalues nearest to `shift`; 0: all finite ones
  double shift = 0;                 ///< [Hz]
  std::optional<double> time = {};  ///< about the state at this time [s]; default: the first
};

/// All that the command line knows, options of `run` that are seldom given among them. Returns the
/// exit code.
int command_line(int argc, char** argv);
int run(const RunOptions& options);
int validate(const std::string& deck, const SymbolValues& symbols, bool json);
int describe(const std::string& deck, const SymbolValues& symbols, bool json);
/// Reduces a finite element model to a FEM data file, and reports beside it as OUTPUT.json.
int reduce_model(const ReduceCommand& command);
/// What a FEM data file holds; `convert`: name of a copy to write, the packed form when it ends
/// with .bin, or empty.
int fem_info(const std::string& file, bool json, const std::string& convert);
/// Runs `mbcosim-SUBCOMMAND`; returns only when that cannot be started.
int hand_over(const std::string& subcommand, const std::vector<std::string>& arguments);
/// Shows a deck in a browser, at `http` ("HOST:PORT"): becomes `mbcosim-view` when the deck can be
/// read.
int view(const std::string& deck, const std::string& http);
/// Writes a commented deck of a kind: "pendulum", "beam", "hydraulic", "coupled"; to KIND.mbd
/// without `output`.
int init(const std::string& kind, const std::string& output);
/// Draws columns of result files over time.
int plot(const PlotCommand& command);
/// Compares two sets of result files; kDiffer when they differ beyond the tolerance.
int diff(const DiffCommand& command);
/// Serves an editor on the standard input and output; see lsp/server.h.
int language_server();
/// Prints eigenvalues of a deck as frequencies and damping.
int eig(const EigCommand& command);
/// The words of the input language, served or refused by name.
int keywords(bool json);

}  // namespace mbcosim::cli
