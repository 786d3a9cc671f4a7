#include "model/card.h"

#include "model/model.h"

namespace mbcosim {

Model& Card::model() { return builder().model(); }

void Card::fail(const std::string& message, const std::string& hint) {
  fail_at(last(), message, hint);
  throw std::logic_error(
      "fail_at returned");  // it throws; GCC does not see noreturn through a virtual call
}

}  // namespace mbcosim
