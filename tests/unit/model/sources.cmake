set(SOURCES drives_test.cpp scalar_functions_test.cpp)
