set(SOURCES drawing.cpp element.cpp general_element.cpp log_text.cpp read_dof.cpp families.cpp unsupported.cpp)
