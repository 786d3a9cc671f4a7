/// The daemon that takes the steps of an instance, over its HTTP door.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "fmi/manifest.h"
#include "input/symbol_values.h"
#include "model/diagnostic.h"

namespace mbcosim::fmi {

/// A simulation on the daemon, which is deleted at the end. Every wait is bounded. Failures have
/// ErrorKind::peer when the daemon cannot be reached or does not know the simulation any more.
class Remote {
 public:
  struct Step {
    double size = 0, next_size = 0;  ///< of this step, and of the next one as the deck has it [s]
    bool ended = false;              ///< no step: the deck ended the run before its final time
  };
  struct Choice {
    std::string display_name;  ///< for people who look at the daemon
    SymbolValues symbols;      ///< other values than the deck's
    std::uint64_t model_digest = 0;
  };

  /// Sends the deck, of which both sides must read the same model. The environment variables
  /// MBCOSIM_TOKEN or MBCOSIM_TOKEN_FILE have the token.
  static Result<std::unique_ptr<Remote>> create(const Manifest& manifest,
                                                const std::map<std::string, std::string>& files,
                                                const Choice& choice);
  ~Remote();
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  /// One step of the deck's length, or one that ends at `end` [s]. Nothing has changed when it
  /// fails. That somebody else has stepped the simulation is a failure, too.
  Result<Step> step(std::optional<double> end);
  /// The state as bytes of `Simulation::export_state`.
  Result<std::string> state();
  /// `number`: of the last step of that state.
  mbcosim::Status go_to(std::string_view state, std::int64_t number);

 private:
  struct Connection;
  explicit Remote(std::unique_ptr<Connection> connection);
  Error is_no_daemon(const std::string& why) const;
  Result<nlohmann::json> call(const std::string& method, nlohmann::json request,
                              bool answers_are_a_stream = false);
  Result<nlohmann::json> export_in_turn();
  mbcosim::Status create(nlohmann::json request, std::uint64_t model_digest);

  std::unique_ptr<Connection> connection_;
  std::string simulation_;   ///< its name; empty: none yet
  std::int64_t number_ = 0;  ///< of its last step
};

}  // namespace mbcosim::fmi
