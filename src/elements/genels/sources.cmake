set(SOURCES read_scalar_genels.cpp read_linear_system.cpp register.cpp scalar_genels.cpp linear_system.cpp pencil_scaling.cpp)
