/// Messages of the Language Server Protocol on file descriptors: a header with the length, then
/// JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace mbcosim::lsp {

using Json = nlohmann::json;

class Wire {
 public:
  Wire(int in, int out) : in_(in), out_(out) {}
  /// The next message, discarded where it is no JSON or nested deeper than any of the protocol;
  /// empty at the end of the input. Halves of surrogate pairs, which editors send of a text that is
  /// being written, become U+FFFD. Throws std::runtime_error when the header is wrong or the
  /// message is larger than 64 MiB.
  std::optional<Json> read();
  void write(const Json& message);
  /// Has something come that was not read yet?
  bool waiting() const;

 private:
  bool fill();

  int in_, out_;
  std::string buffer_;
};

}  // namespace mbcosim::lsp
