set(SOURCES decompositions.cpp processor.cpp rotation.cpp sparse_lu.cpp thread_team.cpp)
