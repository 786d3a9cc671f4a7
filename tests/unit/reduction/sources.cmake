set(SOURCES block_lanczos_test.cpp reduce_test.cpp sparse_factor_test.cpp)
