set(SOURCES abstract_force.cpp external_structural.cpp read_external.cpp read_forces.cpp structural_force.cpp)
