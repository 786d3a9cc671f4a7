/// Numbers as text. Numbers of usual size and precision (at most 17 digits) take one product with a
/// rounded power of ten; `std::to_chars`, several times slower, serves the others, and the few of
/// which that product does not tell how they are rounded.
#pragma once

namespace mbcosim {

/// Writes v as `printf("%.*e", precision, v)` does, correctly rounded (ties to even), and returns
/// the end; room for precision + 16 characters is needed.
char* write_scientific(char* out, double v, int precision);

/// The same for `printf("%.*g", precision, v)`.
char* write_general(char* out, double v, int precision);

}  // namespace mbcosim
