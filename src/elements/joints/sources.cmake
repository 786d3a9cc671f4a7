set(SOURCES register.cpp joint_common.cpp clamp.cpp deformable.cpp distance.cpp guide.cpp invariant.cpp revolute.cpp rod.cpp
            spherical.cpp total.cpp universal.cpp velocity.cpp)
