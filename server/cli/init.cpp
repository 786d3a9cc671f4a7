/// `mbcosim init`: writes a commented deck to start from.
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "cli/commands.h"
#include "cli/starters.h"

namespace mbcosim::cli {

int init(const std::string& kind, const std::string& output) {
  const Starter* chosen = nullptr;
  std::string known;
  for (const Starter& starter : starters()) {
    known += (known.empty() ? "" : ", ") + std::string(starter.kind);
    if (starter.kind == kind) chosen = &starter;
  }
  if (!chosen) {
    std::fprintf(stderr, "error: there is no starter \"%s\"; there are %s\n", kind.c_str(),
                 known.c_str());
    return kRefused;
  }
  const std::string path = output.empty() ? kind + ".mbd" : output;
  std::FILE* file = std::fopen(path.c_str(), "wx");  // never over a file that is there
  bool written =
      file && std::fwrite(chosen->deck.data(), 1, chosen->deck.size(), file) == chosen->deck.size();
  if (file && std::fclose(file) != 0) written = false;
  if (!written) {
    std::fprintf(stderr, "error: cannot write \"%s\": %s\n", path.c_str(), std::strerror(errno));
    return kRefused;
  }
  std::printf(
      "%s is written. Next:\n  mbcosim describe %s\n  mbcosim run %s -o results\n"
      "  mbcosim plot results %s\n",
      path.c_str(), path.c_str(), path.c_str(), chosen->plot);
  return kDone;
}

}  // namespace mbcosim::cli
