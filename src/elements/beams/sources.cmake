set(SOURCES beam.cpp beam_duals.cpp beam_results.cpp beam_slider.cpp beam_tangent.cpp draw_beams.cpp helicoidal_beam.cpp inverse_beam.cpp read_beams.cpp)
