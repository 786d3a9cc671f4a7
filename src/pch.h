/// Precompiled header of the engine: what most of its sources include of the standard library and
/// Eigen. Headers of our own are left out: a change of one would compile everything again.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>
