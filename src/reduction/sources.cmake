set(SOURCES basis.cpp elimination_order.cpp fe_model.cpp inertia.cpp job.cpp lanczos.cpp matrix_market.cpp reduce.cpp report.cpp sparse_factor.cpp structure.cpp supernodes.cpp)
