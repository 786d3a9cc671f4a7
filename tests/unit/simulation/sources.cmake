set(SOURCES rigid_body_test.cpp)
