/// An external force's messages in text files: `"<in>" [, unlink], "<out>" [, no clobber]`.
#pragma once

#include <string>
#include <vector>

#include "mbdyn/force_dialogue.h"
#include "mbdyn/link.h"

namespace mbcosim::mbdyn {

/// States are written to a temporary file beside `out`, which is then renamed; loads are read when
/// `in` appears. There are no commands: every answer is the last of its step.
class FileWire : public ForceWire {
 public:
  FileWire(const ChannelAddress& address, std::string name, ForceForm form, Patience patience);
  void send(Command command, const ForceState& state) override;
  Command receive(ForceLoads& loads) override;
  void end(std::chrono::steady_clock::time_point) override {}

 private:
  void wait_until(bool exists, const std::string& path) const;
  std::string read() const;  ///< at most what the numbers and some comments may take
  ForceLoads parse(const std::string& text) const;

  const ChannelAddress address_;
  const std::string name_;
  const ForceForm form_;
  const Patience patience_;
};

/// What a FileWire of this address writes, replaces or removes.
std::vector<std::string> files_changed_at(const ChannelAddress& address);

/// The state as MBDyn writes it, with `precision` digits after the point.
std::string state_text(const ForceForm& form, const ForceState& state, int precision,
                       bool scientific = true);

}  // namespace mbcosim::mbdyn
