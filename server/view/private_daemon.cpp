#include "view/private_daemon.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

namespace mbcosim::view {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
constexpr std::string_view kOptions =
    "MBCOSIMD_";                            ///< begins variables that are a daemon's options
constexpr std::size_t kLongestFolder = 80;  ///< the path of a socket has at most 107 bytes

std::string new_folder() {
  std::string name = (fs::temp_directory_path() / "mbcosim-view-XXXXXX").string();
  if (name.size() > kLongestFolder) name = "/tmp/mbcosim-view-XXXXXX";
  if (!::mkdtemp(name.data()))
    throw std::system_error(errno, std::generic_category(), "cannot make a folder");
  return name;
}

/// The environment but for the options of another daemon that are in it.
std::vector<char*> own_environment() {
  std::vector<char*> variables;
  for (char** variable = environ; *variable; ++variable)
    if (std::string_view(*variable).substr(0, kOptions.size()) != kOptions)
      variables.push_back(*variable);
  variables.push_back(nullptr);
  return variables;
}

/// In the child: becomes the daemon, which ends when the thread that started it does.
[[noreturn]] void become(const std::string& program, const std::string& address,
                         const std::string& http, int output, char* const* environment) {
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(output, STDOUT_FILENO);
  ::execle(program.c_str(), program.c_str(), "--listen", address.c_str(), "--http", http.c_str(),
           "--log-level", "warn", static_cast<char*>(nullptr), environment);
  ::_exit(127);
}

}  // namespace

PrivateDaemon::PrivateDaemon(const std::string& program, const std::string& http, double seconds)
    : folder_(new_folder()), address_("unix:" + folder_ + "/mbcosim.sock") {
  try {
    start(program, http);
    page_ = read_page(seconds);
  } catch (...) {
    stop();
    throw;
  }
}

PrivateDaemon::~PrivateDaemon() { stop(); }

void PrivateDaemon::start(const std::string& program, const std::string& http) {
  if (::access(program.c_str(), X_OK) != 0)
    throw std::runtime_error("cannot start " + program + "; it is built with the server");
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("cannot make a pipe");
  output_ = ends[0];
  const std::vector<char*> environment = own_environment();
  child_ = ::fork();
  if (child_ == 0) become(program, address_, http, ends[1], environment.data());
  ::close(ends[1]);
  if (child_ < 0) throw std::runtime_error("cannot start " + program);
}

std::string PrivateDaemon::read_page(double seconds) const {
  constexpr std::string_view kMark = "page: ";
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(seconds));
  std::string text;
  while (Clock::now() < end) {
    pollfd state{output_, POLLIN, 0};
    if (::poll(&state, 1, 100) <= 0) continue;
    std::array<char, 1024> piece;
    const ssize_t count = ::read(output_, piece.data(), piece.size());
    if (count <= 0) throw std::runtime_error("the daemon ended before it served its page");
    text.append(piece.data(), static_cast<std::size_t>(count));
    const std::size_t mark = text.find(kMark), line = text.find('\n', mark);
    if (mark == std::string::npos || line == std::string::npos) continue;
    return text.substr(mark + kMark.size(), line - mark - kMark.size());
  }
  throw std::runtime_error("the daemon did not start in time");
}

void PrivateDaemon::wait() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  const timespec look{0, 200000000};
  while (::sigtimedwait(&signals, nullptr, &look) < 0) {
    int status = 0;
    if (::waitpid(child_, &status, WNOHANG) != child_) continue;
    child_ = -1;
    throw Lost(WIFSIGNALED(status)
                   ? "the daemon was ended by signal " + std::to_string(WTERMSIG(status))
                   : "the daemon has ended with exit code " + std::to_string(WEXITSTATUS(status)));
  }
}

void PrivateDaemon::stop() {
  if (child_ > 0) {
    ::kill(child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);  // bounded by the daemon's own grace period
    child_ = -1;
  }
  if (output_ >= 0) ::close(output_);
  output_ = -1;
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace mbcosim::view
