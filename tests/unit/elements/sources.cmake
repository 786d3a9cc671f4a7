set(SOURCES joint_conformance_test.cpp)
