/// Vectors and orientations as the numbers of a message.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <string>

#include "math/types.h"
#include "mbcosim/v1/coupling_types.pb.h"

namespace mbcosim::server {

using Numbers = google::protobuf::RepeatedField<double>;

void put(const Vec3& v, Numbers* out);
void put_rotation(const Mat3& R, v1::RotationForm form, Numbers* out);
int rotation_size(v1::RotationForm form);
/// The orientation that starts at `at`; false: the numbers are none.
bool take_rotation(const Numbers& numbers, int at, v1::RotationForm form, Mat3* R);
/// The rotation nearest to a matrix that is nearly one.
Mat3 nearest_rotation(const Mat3& A);
Vec3 triple(const Numbers& numbers, std::size_t i);
/// Empty, or what is wrong with the length or the values of an array.
std::string check_array(const char* name, const Numbers& numbers, std::size_t size,
                        bool may_be_empty);

}  // namespace mbcosim::server
