/// Numbers as text.
#pragma once

namespace mbcosim {

/// Writes v as `printf("%.*e", precision, v)` does, correctly rounded (ties to even), and returns
/// the end; room for precision + 9 characters is needed. Numbers of usual size and precision (at
/// most 16) take exact integer arithmetic, several times as fast as `std::to_chars`, which serves
/// the others.
char* write_scientific(char* out, double v, int precision);

}  // namespace mbcosim
