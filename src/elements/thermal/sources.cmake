set(SOURCES thermal.cpp)
