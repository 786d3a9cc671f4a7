set(SOURCES abstract_force.cpp draw_forces.cpp read_forces.cpp structural_force.cpp)
