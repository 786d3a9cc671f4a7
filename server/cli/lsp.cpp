/// `mbcosim lsp`: a language server on the standard input and output.
#include <unistd.h>

#include <cstdio>
#include <exception>

#include "cli/commands.h"
#include "cli/lsp/server.h"

namespace mbcosim::cli {

int language_server() try {
  lsp::Wire wire(STDIN_FILENO, STDOUT_FILENO);
  return lsp::Server(wire).run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "mbcosim lsp: %s\n", error.what());
  return kRefused;
}

}  // namespace mbcosim::cli
