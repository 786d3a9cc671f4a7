set(SOURCES bistop.cpp composite.cpp function_laws.cpp linear.cpp piecewise.cpp register.cpp shock_absorber.cpp smooth.cpp symbolic.cpp)
