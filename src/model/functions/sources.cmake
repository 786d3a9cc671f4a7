set(SOURCES read_functions.cpp scalar_functions.cpp)
