set(SOURCES rotation.cpp)
