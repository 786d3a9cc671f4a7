set(SOURCES force_lines_test.cpp model_log_test.cpp result_history_test.cpp result_writer_test.cpp scientific_test.cpp drive_lines_test.cpp)
