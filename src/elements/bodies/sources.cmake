set(SOURCES body.cpp draw_bodies.cpp inertia_report.cpp modal_node_body.cpp read_bodies.cpp read_inertia.cpp read_variable_body.cpp variable_body.cpp)
