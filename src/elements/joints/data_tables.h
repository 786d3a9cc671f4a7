/// Names and units of the private data that joints have in common.
#pragma once

#include "model/datum.h"

namespace mbcosim {

using ThreeData = std::array<DatumName, 3>;
inline constexpr ThreeData kForceData = {{{"Fx", "N"}, {"Fy", "N"}, {"Fz", "N"}}};
inline constexpr ThreeData kMomentData = {{{"Mx", "N m"}, {"My", "N m"}, {"Mz", "N m"}}};
inline constexpr ThreeData kPositionData = {{{"px", "m"}, {"py", "m"}, {"pz", "m"}}};
inline constexpr ThreeData kDisplacementData = {{{"dx", "m"}, {"dy", "m"}, {"dz", "m"}}};
inline constexpr ThreeData kVelocityData = {{{"vx", "m/s"}, {"vy", "m/s"}, {"vz", "m/s"}}};
inline constexpr ThreeData kAngleData = {{{"rx", "rad"}, {"ry", "rad"}, {"rz", "rad"}}};
inline constexpr ThreeData kImposedAngleData = {{{"tx", "rad"}, {"ty", "rad"}, {"tz", "rad"}}};
inline constexpr ThreeData kSpinData = {{{"wx", "rad/s"}, {"wy", "rad/s"}, {"wz", "rad/s"}}};
/// About axis 3 of a hinge: angle and its rate.
inline constexpr std::array<DatumName, 2> kHingeData = {{{"rz", "rad"}, {"wz", "rad/s"}}};

}  // namespace mbcosim
