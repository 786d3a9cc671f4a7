set(SOURCES fluids.cpp register.cpp)
