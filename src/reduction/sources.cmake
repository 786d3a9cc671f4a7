set(SOURCES basis.cpp fe_model.cpp inertia.cpp job.cpp lanczos.cpp matrix_market.cpp reduce.cpp report.cpp structure.cpp)
