set(SOURCES beam.cpp beam_results.cpp beam_tangent.cpp read_beams.cpp)
