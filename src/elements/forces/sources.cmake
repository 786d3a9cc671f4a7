set(SOURCES abstract_force.cpp read_forces.cpp structural_force.cpp)
