set(SOURCES abstract_force.cpp register.cpp structural_force.cpp)
