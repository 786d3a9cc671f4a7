set(SOURCES decompositions.cpp processor.cpp rotation.cpp thread_team.cpp)
