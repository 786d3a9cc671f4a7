set(SOURCES discrete_control.cpp electric.cpp read_discrete_control.cpp read_electric.cpp read_scalar_genels.cpp
    read_state_space.cpp register.cpp scalar_genels.cpp state_space.cpp)
