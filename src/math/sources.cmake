set(SOURCES decompositions.cpp processor.cpp rotation.cpp sparse_lu.cpp)
