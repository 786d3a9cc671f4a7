/// Precompiled header of the core: the standard library and Eigen.
#pragma once

#include <Eigen/Core>
#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>
