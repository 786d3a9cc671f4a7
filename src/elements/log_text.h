/// Pieces of .log lines (MBDyn input manual, log file): each number preceded by a blank, six
/// significant digits.
#pragma once

#include <initializer_list>
#include <string>

#include "math/types.h"

namespace mbcosim {

std::string log_integers(std::initializer_list<int> values);
std::string log_values(std::initializer_list<double> values);
std::string log_vector(const Vec3& v);
std::string log_matrix(const Mat3& m);  ///< by rows

}  // namespace mbcosim
