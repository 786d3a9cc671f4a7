/// What the subcommands share: opening a deck and telling the user what was found in it.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "simulation/load.h"

namespace mbcosim::cli {

/// Does the deck come from a pipe or a terminal, as /dev/stdin? It has no folder: files that it
/// names count from the working one.
bool is_piped(const std::string& deck);

/// Reads a deck from the user's own files, without the restrictions that uploaded decks are under.
/// `read` gets the names of all files that it consists of; may be null.
DeckReport load_path(const std::string& deck, const SymbolValues& symbols = {},
                     std::vector<std::string>* read = nullptr);

/// Diagnostics as text, one after another.
void print_diagnostics(const std::vector<Diagnostic>& diagnostics, std::FILE* out);

/// `kDone`, or how a deck with these diagnostics is refused: `kRefused` for an exceeded limit.
ExitCode exit_code_of(const LoadReport& report);
ExitCode exit_code_of(const Error& error);

/// Is there neither a node nor an element, and was nothing printed, as a calculation would?
bool has_nothing_to_run(const LoadReport& report);
/// Says so.
void print_nothing_to_run(const std::string& deck, Severity severity, std::FILE* out);

/// An error of the solver: message, residual history, worst equations.
void print_error(const Error& error, std::FILE* out);

}  // namespace mbcosim::cli
