set(SOURCES block_kernels_test.cpp block_lanczos_test.cpp reduce_test.cpp sparse_factor_test.cpp)
