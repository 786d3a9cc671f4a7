set(SOURCES beam.cpp beam_output.cpp register.cpp)
