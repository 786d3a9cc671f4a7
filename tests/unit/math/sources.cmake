set(SOURCES rotation_test.cpp thread_team_test.cpp)
