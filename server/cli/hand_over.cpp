/// Subcommands that are programs of their own, beside this one: they need more than the engine.
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "cli/commands.h"

namespace mbcosim::cli {

int hand_over(const std::string& subcommand, const std::vector<std::string>& arguments) {
  const std::string name = "mbcosim-" + subcommand;
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program =
      (error ? std::filesystem::path(name) : self.parent_path() / name).string();
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  ::execvp(program.c_str(), argv.data());
  std::fprintf(stderr, "mbcosim %s: cannot start %s: %s; it is installed with the daemon\n",
               subcommand.c_str(), name.c_str(), std::strerror(errno));
  return kRefused;
}

}  // namespace mbcosim::cli
