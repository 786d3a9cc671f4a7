set(SOURCES fluids.cpp read_fluids.cpp)
