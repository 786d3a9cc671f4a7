set(SOURCES element.cpp registry.cpp unsupported.cpp)
