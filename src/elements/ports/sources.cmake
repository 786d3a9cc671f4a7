set(SOURCES attach.cpp external_modal.cpp external_structural.cpp imposed_motion.cpp port_element.cpp read_external.cpp read_ports.cpp stream_output.cpp)
