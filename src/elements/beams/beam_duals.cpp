// Beams in dual numbers, against which tests hold their closed forms.
#include "elements/beams/beam_section.h"

namespace mbcosim {

#define MBCOSIM_INSTANTIATE(Nodes, T)                                                         \
  template auto Beam<Nodes>::line(const Local<T>&) const->Line<T>;                            \
  template auto Beam<Nodes>::section(const Local<T>&, const Line<T>&, int) const->Section<T>; \
  template auto Beam<Nodes>::internal_force(const Local<T>&, int, const Section<T>&)          \
      const->Eigen::Matrix<T, 6, 1>;
MBCOSIM_INSTANTIATE(2, Dual<12>)
MBCOSIM_INSTANTIATE(3, Dual<18>)
#undef MBCOSIM_INSTANTIATE

}  // namespace mbcosim
