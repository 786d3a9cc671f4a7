set(SOURCES beam.cpp beam_output.cpp beam_tangent.cpp register.cpp)
