#include "cli/chart.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

extern char** environ;

namespace mbcosim::cli {
namespace {

constexpr std::string_view kMarks = "*+ox#@%&";

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;

  void include(const std::vector<double>& values) {
    for (const double value : values) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  /// A range that is a point is widened, an empty one becomes (0, 1).
  void open() {
    if (low > high) low = 0, high = 1;
    if (low == high) {
      const double half = low == 0 ? 1 : std::abs(low) / 2;
      low -= half;
      high += half;
    }
  }
  int place(double value, int cells) const {
    return std::clamp(static_cast<int>((value - low) / (high - low) * cells), 0, cells - 1);
  }
};

std::string number(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

void draw(const Curve& curve, char mark, const Range& x, const Range& y,
          std::vector<std::string>& grid) {
  const int columns = static_cast<int>(grid.front().size()), lines = static_cast<int>(grid.size());
  for (std::size_t k = 0; k < curve.x.size(); ++k)
    if (std::isfinite(curve.y[k]))
      grid[lines - 1 - y.place(curve.y[k], lines)][x.place(curve.x[k], columns)] = mark;
}

/// Runs a program with `script` as its standard input; its exit code, 127 when it is not there.
int feed(const std::vector<std::string>& command, const std::string& script) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return 127;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed =
      ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  std::size_t written = 0;
  while (!failed && written < script.size()) {
    const ssize_t count = ::write(ends[1], script.data() + written, script.size() - written);
    if (count <= 0) break;
    written += static_cast<std::size_t>(count);
  }
  ::close(ends[1]);
  int status = 127 << 8;
  if (!failed) ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

/// A text as gnuplot reads it, on one line.
std::string gnuplot_text(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "''" : std::string(1, c == '\n' ? ' ' : c);
  return result + "'";
}

std::string python_text(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') result += '\\';
    result += c == '\n' ? "\\n" : std::string(1, c);
  }
  return result + "'";
}

std::string pairs(const Curve& curve, const char* separator, const char* end) {
  std::string text;
  std::array<char, 64> pair;
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    std::snprintf(pair.data(), pair.size(), "%.9g%s%.9g%s", curve.x[k], separator, curve.y[k], end);
    text += pair.data();
  }
  return text;
}

std::string gnuplot_script(const std::vector<Curve>& curves, const std::string& x_name,
                           const std::string& title, const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension();
  const std::string terminal = ending == ".svg"   ? "svg size 900,500"
                               : ending == ".pdf" ? "pdfcairo"
                                                  : "pngcairo size 900,500";
  std::string script = "set terminal " + terminal + " noenhanced\nset output " +
                       gnuplot_text(path) + "\nset grid\nset xlabel " + gnuplot_text(x_name) +
                       "\nset title " + gnuplot_text(title) + "\nplot ";
  for (std::size_t k = 0; k < curves.size(); ++k)
    script +=
        (k ? ", " : "") + std::string("'-' with lines lw 2 title ") + gnuplot_text(curves[k].name);
  script += "\n";
  for (const Curve& curve : curves) script += pairs(curve, " ", "\n") + "e\n";
  return script;
}

std::string python_script(const std::vector<Curve>& curves, const std::string& x_name,
                          const std::string& title, const std::string& path) {
  std::string script =
      "import matplotlib\nmatplotlib.use('Agg')\nfrom matplotlib import pyplot\n"
      "nan, inf = float('nan'), float('inf')\n"
      "figure, axes = pyplot.subplots(figsize=(9, 5), layout='constrained')\n";
  for (const Curve& curve : curves)
    script += "axes.plot(*zip(" + pairs(curve, ",", "),(").insert(0, "(") +
              "nan,nan)), label=" + python_text(curve.name) + ")\n";
  return script + "axes.set(xlabel=" + python_text(x_name) + ", title=" + python_text(title) +
         ")\naxes.grid(alpha=0.3)\naxes.legend()\nfigure.savefig(" + python_text(path) +
         ", dpi=100)\n";
}

}  // namespace

std::string text_chart(const std::vector<Curve>& curves, const std::string& x_name, int columns,
                       int lines) {
  Range x, y;
  for (const Curve& curve : curves) {
    x.include(curve.x);
    y.include(curve.y);
  }
  x.open();
  y.open();
  constexpr int kMargin = 11;
  const int width = std::max(columns - kMargin - 1, 20);
  std::vector<std::string> grid(std::max(lines, 4), std::string(width, ' '));
  for (std::size_t k = 0; k < curves.size(); ++k)
    draw(curves[k], kMarks[k % kMarks.size()], x, y, grid);
  std::string text;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    const bool middle = k == grid.size() / 2;
    const std::string label = k == 0                 ? number(y.high)
                              : k + 1 == grid.size() ? number(y.low)
                              : middle               ? number((y.low + y.high) / 2)
                                                     : "";
    text += std::string(kMargin - 1 - std::min<std::size_t>(label.size(), kMargin - 1), ' ') +
            label + " |" + grid[k] + "\n";
  }
  const std::string from = number(x.low), to = number(x.high) + "  " + x_name;
  text += std::string(kMargin, ' ') + "+" + std::string(width, '-') + "\n" +
          std::string(kMargin + 1, ' ') + from +
          std::string(std::max<int>(1, width - static_cast<int>(from.size() + to.size())), ' ') +
          to + "\n";
  for (std::size_t k = 0; k < curves.size(); ++k)
    text += std::string(kMargin + 1, ' ') + kMarks[k % kMarks.size()] + " " + curves[k].name + "\n";
  return text;
}

Status picture(const std::vector<Curve>& curves, const std::string& x_name,
               const std::string& title, const std::string& path) {
  const std::filesystem::path file(path), folder = file.parent_path();
  const std::string ending = file.extension();
  if (ending != ".png" && ending != ".svg" && ending != ".pdf")
    return make_error(ErrorKind::argument, "",
                      "\"" + path + "\": the name of a picture ends in .png, .svg or .pdf");
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    return make_error(ErrorKind::io, "",
                      "cannot draw \"" + path + "\": there is no folder \"" + folder.string() +
                          "\"; make it with `mkdir -p`");
  std::error_code none;
  std::filesystem::remove(path, none);
  const auto drawn_by = [&](const std::vector<std::string>& program, const std::string& script) {
    return feed(program, script) == 0 && std::filesystem::exists(path);
  };
  if (drawn_by({"gnuplot"}, gnuplot_script(curves, x_name, title, path)) ||
      drawn_by({"python3", "-"}, python_script(curves, x_name, title, path)))
    return ok();
  return make_error(
      ErrorKind::io, "",
      "cannot draw \"" + path +
          "\": that is done by gnuplot, or by Python's matplotlib (Debian: gnuplot-nox or "
          "python3-matplotlib); without --png the curves are drawn on the terminal");
}

}  // namespace mbcosim::cli
