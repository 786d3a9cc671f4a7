set(SOURCES register.cpp)
