set(SOURCES beam_test.cpp joint_conformance_test.cpp)
