set(SOURCES integrator.cpp line_search.cpp linear_solver.cpp newton.cpp singularity.cpp system.cpp initial_assembly.cpp stepper.cpp)
