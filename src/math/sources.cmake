set(SOURCES decompositions.cpp rotation.cpp sparse_lu.cpp)
