set(SOURCES model_log.cpp eigen_text.cpp netcdf_file.cpp netcdf_library.cpp netcdf_writer.cpp record.cpp result_files.cpp sample_files.cpp scientific.cpp text_file.cpp text_writer.cpp)
