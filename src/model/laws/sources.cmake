set(SOURCES linear.cpp register.cpp)
