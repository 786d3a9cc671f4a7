/// Internal to the client library: decks on disk as bundles to upload.
#pragma once

#include <map>
#include <string>

namespace mbcosim::client {

/// Bytes of the deck `main` in `folder`, of `NAME.view.json` beside it, and of every file below the
/// folder that they name in quotes, by name.
std::map<std::string, std::string> collect_bundle(const std::string& folder,
                                                  const std::string& main);

}  // namespace mbcosim::client
