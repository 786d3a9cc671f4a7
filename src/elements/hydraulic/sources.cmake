set(SOURCES register.cpp read_values.cpp pipe_friction.cpp draw_hydraulics.cpp actuator.cpp orifice.cpp dynamic_pipe.cpp pipe.cpp minor_loss.cpp
    control_valve.cpp spool_valve.cpp pressure_valve.cpp accumulator.cpp tank.cpp)
