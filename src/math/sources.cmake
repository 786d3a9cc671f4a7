set(SOURCES decompositions.cpp large_pages.cpp processor.cpp rotation.cpp subnormals.cpp thread_team.cpp)
