/// mbcosim replay: hands over to the program beside this one, which knows messages and sessions.
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "cli/commands.h"

namespace mbcosim::cli {

int replay(const std::vector<std::string>& arguments) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program =
      (error ? std::filesystem::path("mbcosim-replay") : self.parent_path() / "mbcosim-replay")
          .string();
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  ::execvp(program.c_str(), argv.data());
  std::fprintf(stderr,
               "mbcosim replay: cannot start mbcosim-replay: %s; it is installed with the daemon\n",
               std::strerror(errno));
  return kRefused;
}

}  // namespace mbcosim::cli
