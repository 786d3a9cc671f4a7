set(SOURCES drawing.cpp element.cpp families.cpp general_element.cpp lift.cpp log_text.cpp placed_elements.cpp read_dof.cpp read_number.cpp unsupported.cpp)
