set(SOURCES attach.cpp external_modal.cpp imposed_motion.cpp port_element.cpp read_ports.cpp stream_output.cpp)
