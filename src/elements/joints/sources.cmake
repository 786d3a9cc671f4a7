set(SOURCES register.cpp joint_common.cpp clamp.cpp revolute.cpp spherical.cpp distance.cpp)
