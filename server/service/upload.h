/// Decks on their way in: bundles in pieces, or names under the model root.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "mbcosim/v1/simulations.pb.h"
#include "service/attached_files.h"
#include "service/config.h"
#include "simulation/load.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// Files that arrive in pieces.
class Bundle {
 public:
  Bundle(const ServiceLimits& limits, MemoryBudget& memory) : limits_(limits), share_(memory) {}
  /// Appends a piece. Throws Refusal for a bad name or an exceeded limit.
  void add(const v1::FileChunk& chunk);
  std::map<std::string, std::string> take() { return std::move(files_); }
  /// Of names and contents, before they are taken.
  std::uint64_t digest() const;

 private:
  const ServiceLimits& limits_;
  MemoryShare share_;
  std::int64_t bytes_ = 0;
  std::map<std::string, std::string> files_;
};

/// A deck on its way in. Throws Refusal for messages out of turn.
class DeckUpload {
 public:
  DeckUpload(const ServiceLimits& limits, MemoryBudget& memory) : bundle_(limits, memory) {}
  /// `share`: of the message.
  void add(v1::UploadRequest& message, MemoryShare share);
  /// All of it at once.
  void add(const v1::InlineUpload& whole);
  /// Throws OUT_OF_TURN when none has come.
  const v1::UploadHeader& header() const;
  std::map<std::string, std::string> take_files() { return bundle_.take(); }
  /// Of header and files, before they are taken.
  std::uint64_t digest() const;

 private:
  MemoryShare header_share_;
  std::optional<v1::UploadHeader> header_;
  Bundle bundle_;
};

/// A deck as it can be kept: its main file, and the files that reading it asked for.
struct KeptDeck {
  std::string main_file;
  std::map<std::string, std::string> files;
  v1::CreateOptions options;  ///< with which it was read
};

/// A deck that was read, and what viewers get with it.
struct LoadedDeck : DeckReport {
  std::shared_ptr<const AttachedFiles> attached;  ///< null: the deck is wrong
};

/// Reads the deck. Throws Refusal when the model root or the file in it is not to be had; a wrong
/// deck is in the report.
DeckReport read_alone(DeckUpload& upload, const Config& config, const Limits& limits);
/// With what is attached to it; `kept` is filled, null: nothing is kept.
LoadedDeck load(DeckUpload& upload, const Config& config, KeptDeck* kept);
/// The same deck again.
LoadedDeck load(KeptDeck deck, const Config& config);
/// Throws what the first error of a deck is: DECK_ERROR, LIMIT_EXCEEDED, BAD_ARGUMENT, INTERNAL.
[[noreturn]] void refuse_deck(const LoadReport& report);
/// Throws BAD_ARGUMENT for a symbol without a value.
SymbolValues symbols_of(const v1::CreateOptions& options);
/// Throws BAD_ARGUMENT for what is no system of units.
std::optional<UnitSystem> units_of(const v1::CreateOptions& options);
/// Ports that need equations of their own in the model.
std::vector<PortAttachment> attachments(const v1::CreateOptions& options);

}  // namespace mbcosim::server
