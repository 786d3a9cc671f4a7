set(SOURCES dense_tail_test.cpp integrators_test.cpp eigen_test.cpp newton_test.cpp state_space_test.cpp)
