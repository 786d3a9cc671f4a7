/// Parts of elements that hints of `driven` fit to the configuration in which the element is
/// switched on (MBDyn input manual, "Hint").
#pragma once

#include <string_view>

#include "elements/element_view.h"

namespace mbcosim {

/// Numbers of an element of type E: an offset, or an orientation by columns. The set of the
/// elements keeps those that a hint has moved in State::memory.
template <class E>
struct MovablePart {
  std::string_view hint;  ///< "offset{1}"
  int count;
  double* (*numbers)(E& element);
  void (*fit)(E& element, const Local<double>& u);  ///< sets them to what fits where the nodes are
};

}  // namespace mbcosim
