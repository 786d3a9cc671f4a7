/// Numbers below 2.2e-308, which are kept with fewer digits ("subnormal").
#pragma once

namespace mbcosim {

/// What a thread does with subnormal results and operands; 0 where processors have no choice that
/// is known here.
unsigned subnormal_mode();
void set_subnormal_mode(unsigned mode);

/// While it lives, this thread takes subnormal operands and results as zero. Processors need some
/// hundred cycles for an operation on others. They come up where motions fade away along a large
/// model: 1000 beams in a row of which one end is loaded took 1.7 times as long.
class SubnormalsAreZero {
 public:
  SubnormalsAreZero();
  ~SubnormalsAreZero() { set_subnormal_mode(before_); }
  SubnormalsAreZero(const SubnormalsAreZero&) = delete;
  SubnormalsAreZero& operator=(const SubnormalsAreZero&) = delete;

 private:
  unsigned before_ = subnormal_mode();
};

}  // namespace mbcosim
