set(SOURCES body.cpp inertia_report.cpp read_inertia.cpp read_variable_body.cpp register.cpp variable_body.cpp)
