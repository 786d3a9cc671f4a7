/// A model against a record: what peers answered is given again, what the model sends is compared.
#pragma once

#include <string>
#include <vector>

#include "mbcosim/v1/record.pb.h"

namespace mbcosim::replay {

/// How far a replay came.
struct Outcome {
  std::int64_t steps = 0;      ///< attempts at steps, failed ones included
  std::int64_t exchanges = 0;  ///< compared
  std::string difference;      ///< the first one, with step and port; empty: none
  std::string end;             ///< why it ended before the record did; empty: it did not
};

/// Throws std::runtime_error when the deck is not the record's.
Outcome replay_model(const std::string& deck, const std::vector<v1::RecordEntry>& record,
                     double tolerance);

}  // namespace mbcosim::replay
