set(SOURCES register.cpp reading.cpp pipe_friction.cpp actuator.cpp orifice.cpp dynamic_pipe.cpp)
