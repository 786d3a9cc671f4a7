set(SOURCES drive_lines_test.cpp force_lines_test.cpp model_log_test.cpp result_history_test.cpp result_writer_test.cpp run_log_test.cpp scientific_test.cpp)
