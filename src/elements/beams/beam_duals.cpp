// Beams in dual numbers, against which tests hold their closed forms.
#include "elements/beams/beam_section.h"

namespace mbcosim {

#define MBCOSIM_INSTANTIATE(Nodes, T)                                                   \
  template Beam<Nodes>::Line<T> Beam<Nodes>::line(const Local<T>&) const;               \
  template Section<T> Beam<Nodes>::section(const Local<T>&, const Line<T>&, int) const; \
  template Eigen::Matrix<T, 6, 1> Beam<Nodes>::internal_force(const Local<T>&, int,     \
                                                              const Section<T>&) const;
MBCOSIM_INSTANTIATE(2, Dual<12>)
MBCOSIM_INSTANTIATE(3, Dual<18>)
#undef MBCOSIM_INSTANTIATE

}  // namespace mbcosim
