/// An FMU of somebody else: unpacked, its description read.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace mbcosim::peer {

/// Version, kind and the variables of a co-simulation FMU. Throws std::runtime_error with what
/// is wrong.
class FmuArchive {
 public:
  struct Variable {
    std::uint32_t reference = 0;
    bool input = false, output = false;
    bool real = false;                 ///< of type Float64 (FMI 2: Real)
    std::size_t size = 1;              ///< numbers of an array, row by row; 0: not fixed
    std::optional<std::string> start;  ///< as the description has it
  };

  /// Unpacks to a folder of its own, which is removed at the end. Entries that lead out of it are
  /// refused, and so is what would unpack to more than a gigabyte.
  explicit FmuArchive(const std::string& path);
  ~FmuArchive();
  FmuArchive(const FmuArchive&) = delete;
  FmuArchive& operator=(const FmuArchive&) = delete;

  bool is_fmi3() const { return fmi3_; }
  const std::string& token() const { return token_; }
  const std::string& name() const { return name_; }
  bool keeps_states() const { return keeps_states_; }
  std::string library() const;    ///< path of the shared library for this machine
  std::string resources() const;  ///< folder
  const std::map<std::string, Variable>& variables() const { return variables_; }

 private:
  void unpack(const std::string& path);
  void read_description();
  void require_library() const;

  std::string folder_, name_, identifier_, token_;
  bool fmi3_ = false, keeps_states_ = false;
  std::map<std::string, Variable> variables_;
};

}  // namespace mbcosim::peer
