set(SOURCES electric.cpp read_electric.cpp)
