set(SOURCES beam.cpp beam_results.cpp beam_tangent.cpp draw_beams.cpp read_beams.cpp)
