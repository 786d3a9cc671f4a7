set(SOURCES body.cpp register.cpp)
