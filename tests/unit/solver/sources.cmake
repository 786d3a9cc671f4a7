set(SOURCES integrators_test.cpp eigen_test.cpp newton_test.cpp state_space_test.cpp)
