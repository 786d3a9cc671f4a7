set(SOURCES netcdf_test.cpp)
