set(SOURCES register.cpp scalar_functions.cpp)
