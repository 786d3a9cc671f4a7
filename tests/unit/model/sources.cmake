set(SOURCES check_test.cpp model_builder_test.cpp deck_channel_test.cpp diagnostic_test.cpp drives_test.cpp family_test.cpp law_derivatives_test.cpp laws_test.cpp
    scalar_functions_test.cpp unit_system_test.cpp word_table_test.cpp)
