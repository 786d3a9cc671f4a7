set(SOURCES constrained_order_test.cpp forest_parts_test.cpp diagonal_pattern_test.cpp divergence_test.cpp linear_solver_test.cpp sparse_factors_test.cpp supernodal_lu_test.cpp task_order_test.cpp elimination_program_test.cpp integrators_test.cpp eigen_test.cpp newton_test.cpp
    state_space_test.cpp initial_assembly_test.cpp singular_mechanism_test.cpp
    integrator_orders_test.cpp matrix_structure_test.cpp stages_test.cpp step_controller_test.cpp)
