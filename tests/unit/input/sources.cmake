set(SOURCES calculator_test.cpp)
