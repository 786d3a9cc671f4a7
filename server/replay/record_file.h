/// Records of coupling, as files and as what is compared.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbcosim/v1/record.pb.h"

namespace mbcosim::replay {

/// Reads a record; throws std::runtime_error when the file is none.
std::vector<v1::RecordEntry> read_record(const std::string& path);

/// The first field in which two messages differ: "positions[3]: recorded 1, now 1.5". Numbers
/// differ when they do by more than `tolerance` times the larger one; 0: bit for bit.
std::optional<std::string> first_difference(const google::protobuf::Message& recorded,
                                            const google::protobuf::Message& now, double tolerance);

}  // namespace mbcosim::replay
