#pragma once

#include "model/diagnostic.h"

namespace mbcosim {

/// Thrown by a drive that is to end the run where it has no more values (`bailout`): the run ends
/// well at the last accepted step.
class EndOfRun : public EvaluationError {
 public:
  using EvaluationError::EvaluationError;
};
inline constexpr const char* kEndOfRun = "END_OF_RUN";  ///< Error::reason of it

}  // namespace mbcosim
