set(SOURCES workspace.cpp forest_parts.cpp bisected_order.cpp instant.cpp integrator.cpp line_search.cpp linear_solver.cpp load_tangent.cpp newton.cpp
    panel_kernels.cpp panel_kernels_v3.cpp panel_kernels_v4.cpp singularity.cpp supernodal_factor.cpp supernodal_lu.cpp task_order.cpp elimination_program.cpp system.cpp divergence.cpp in_pieces.cpp initial_assembly.cpp inverse_dynamics.cpp stages.cpp step_controller.cpp stepper.cpp third_order.cpp linearization.cpp
    null_space.cpp lapack.cpp eigen_lapack.cpp eigen_spectrum.cpp eigenanalysis.cpp shifted_pencil.cpp state_space.cpp)
