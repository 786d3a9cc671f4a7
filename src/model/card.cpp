#include "model/card.h"

#include "model/model.h"

namespace mbcosim {

Model& Card::model() { return builder().model(); }

void Card::fail(const std::string& message, const std::string& hint, const char* code) {
  fail_at(last(), message, hint, code);
  throw std::logic_error(
      "fail_at returned");  // it throws; GCC does not see noreturn through a virtual call
}

void Card::fail_expected(const std::string& message, const std::string& hint) {
  fail_at(next(), message, hint, "wrong-argument");
  throw std::logic_error("fail_at returned");
}

}  // namespace mbcosim
