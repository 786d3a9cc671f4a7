set(SOURCES element.cpp log_text.cpp registry.cpp unsupported.cpp)
