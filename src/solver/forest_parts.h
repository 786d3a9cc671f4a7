/// Subtrees of an elimination forest for threads.
#pragma once

#include <vector>

namespace mbcosim {

/// The part of each node: 0 … parts − 1, subtrees of about as much work in each part, or `parts`
/// for the nodes above them, which come after all others. All are of that last kind where the
/// forest does not fall into such parts. `parent`: −1 at roots, else after the node.
std::vector<int> forest_parts(const std::vector<int>& parent, const std::vector<double>& work,
                              int parts);

}  // namespace mbcosim
