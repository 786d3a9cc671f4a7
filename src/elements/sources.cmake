set(SOURCES element.cpp general_element.cpp log_text.cpp registry.cpp unsupported.cpp)
