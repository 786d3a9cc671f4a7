set(SOURCES abstract_force.cpp external_structural.cpp read_external.cpp register.cpp structural_force.cpp)
