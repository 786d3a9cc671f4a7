set(SOURCES basis.cpp block_kernels.cpp block_kernels_plain.cpp block_kernels_v3.cpp block_kernels_v4.cpp elimination_order.cpp factorization.cpp fe_model.cpp
    inertia.cpp job.cpp block_lanczos.cpp lanczos.cpp matrix_market.cpp reduce.cpp report.cpp sparse_factor.cpp structure.cpp substitution.cpp supernodes.cpp)
