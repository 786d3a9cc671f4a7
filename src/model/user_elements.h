#pragma once

namespace mbcosim {

/// `use: loadable elements, in assembly`: a ModelPart.
struct UserElementsInAssembly {};

}  // namespace mbcosim
