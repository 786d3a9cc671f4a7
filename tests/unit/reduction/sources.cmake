set(SOURCES reduce_test.cpp sparse_factor_test.cpp)
