set(SOURCES rotation_test.cpp)
