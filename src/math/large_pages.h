/// Memory in pages of 2 MB where the kernel gives them on request.
#pragma once

#include <cstddef>

namespace mbcosim {

/// Asks for large pages for memory that is about to be used for the first time: a kernel takes
/// longer to get half a million small ones than a solver to read them. Memory of fewer than a few
/// large pages stays as it is.
void prefer_large_pages(void* memory, std::size_t bytes);

}  // namespace mbcosim
