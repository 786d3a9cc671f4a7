set(SOURCES adaptive_control.cpp arx_identifier.cpp discrete_control.cpp predictive_law.cpp read_adaptive_control.cpp
    read_discrete_control.cpp sampled_control.cpp)
