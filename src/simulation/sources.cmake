set(SOURCES simulation.cpp state_bytes.cpp variables.cpp load.cpp describe.cpp linearize.cpp)
