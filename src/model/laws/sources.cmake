set(SOURCES bistop.cpp composite.cpp function_laws.cpp law_parts.cpp linear.cpp piecewise.cpp register.cpp shock_absorber.cpp smooth.cpp symbolic.cpp)
