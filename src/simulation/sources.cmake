set(SOURCES simulation.cpp state_bytes.cpp variables.cpp load.cpp model_check.cpp describe.cpp formula.cpp geometry_view.cpp
    linearize.cpp point_motion.cpp)
