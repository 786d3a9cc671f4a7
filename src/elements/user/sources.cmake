set(SOURCES asynchronous_machine.cpp bulk.cpp inline_friction.cpp readers.cpp register.cpp wheel.cpp)
