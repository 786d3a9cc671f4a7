set(SOURCES large_pages_test.cpp eigen_storage_test.cpp pack_test.cpp rotation_test.cpp subnormals_test.cpp thread_team_test.cpp)
