set(SOURCES draw_electric.cpp electric.cpp read_electric.cpp)
