set(SOURCES register.cpp joint_common.cpp clamp.cpp deformable.cpp deformable_tangent.cpp draw_joints.cpp distance.cpp friction.cpp friction_joints.cpp guide.cpp
            invariant.cpp inverse_constraint.cpp revolute.cpp point_contact.cpp rod.cpp rod_bezier.cpp screw.cpp spherical.cpp tikhonov.cpp total.cpp total_tangent.cpp total_equation.cpp universal.cpp
            velocity.cpp)
