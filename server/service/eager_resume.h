/// Suspended simulations that come back before anybody asks for them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rpc/call.h"
#include "service/parts.h"

namespace mbcosim::server {

/// `--resume eager`: all that is suspended when the daemon starts comes back beside other work, one
/// after the other, those used last first. What cannot is named in the log and stays suspended.
class EagerResume {
 public:
  /// Returns at once. `parts` outlives `stop`, and its lanes end before this does.
  void start(const Parts& parts);
  /// The one that is being brought back is given up, and no other is begun.
  void stop() { call_.cancel(); }

 private:
  using Simulations = std::vector<std::pair<std::string, std::string>>;  ///< name and owner
  void resume(const Parts& parts, const Simulations& simulations);

  Call call_;
};

}  // namespace mbcosim::server
