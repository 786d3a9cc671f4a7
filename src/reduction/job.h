/// A reduction as lines `name = value`: what `mbcosim reduce` and the service read.
///
///     mass = M.mtx              # Matrix Market
///     stiffness = K.mtx
///     nodes = nodes.csv         # label,x,y,z
///     basis = craig-bampton
///     interface = 1, 9
///     modes = 10
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>

#include "reduction/reduce.h"

namespace mbcosim {

struct ReductionJob {
  std::map<std::string, std::string> files;  ///< by name: mass, stiffness, nodes, dofs, supports
  ReductionOptions options;

  /// Takes one option; throws ReductionError for an unknown name or a value that is not accepted.
  void set(const std::string& name, const std::string& value);
};

struct ReductionOptionHelp {
  const char* name;
  const char* help;
};
/// All names that `set` takes.
const std::vector<ReductionOptionHelp>& reduction_option_help();

/// What one source says, a job file, a command line or a request: each name once, and the number of
/// modes in one way.
class ReductionNames {
 public:
  /// Throws ReductionError.
  void add(const std::string& name);

 private:
  std::set<std::string, std::less<>> names_;
};

/// Adds the lines of `text` to `job`; `name` is used in messages.
void read_job(const std::string& name, std::string_view text, ReductionJob& job);
/// Reads the files that the job names through `read`.
FeModel load_model(const ReductionJob& job,
                   const std::function<std::string(const std::string&)>& read);

}  // namespace mbcosim
