set(SOURCES reduce_test.cpp)
