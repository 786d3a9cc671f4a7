set(SOURCES adaptive_control.cpp arx_identifier.cpp discrete_control.cpp electric.cpp predictive_law.cpp read_adaptive_control.cpp read_discrete_control.cpp read_electric.cpp read_scalar_genels.cpp
    read_state_space.cpp register.cpp sampled_control.cpp scalar_genels.cpp state_space.cpp)
