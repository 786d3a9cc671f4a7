set(SOURCES model_log.cpp record.cpp text_writer.cpp)
