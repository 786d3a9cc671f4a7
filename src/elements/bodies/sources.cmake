set(SOURCES body.cpp inertia_report.cpp read_inertia.cpp register.cpp)
