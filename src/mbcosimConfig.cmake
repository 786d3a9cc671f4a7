# find_package(mbcosim): mbcosim::core, the engine as a library, and mbcosim::client when the server was built.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3)
find_dependency(Threads)
include(${CMAKE_CURRENT_LIST_DIR}/mbcosimTargets.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/mbcosimClientTargets.cmake OPTIONAL)
