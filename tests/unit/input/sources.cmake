set(SOURCES bad_arguments_test.cpp calculator_test.cpp deck_errors_test.cpp drive_values_test.cpp elements_test.cpp frames_test.cpp loop_model_test.cpp malformed_test.cpp nodes_test.cpp
    run_strings_test.cpp settings_test.cpp sources_test.cpp statements_test.cpp structured_values_test.cpp symbols_test.cpp
    vocabulary_test.cpp warnings_test.cpp written_card_test.cpp
    element_cards.cpp law_cards.cpp object_cards.cpp word_decks.cpp words_refused_test.cpp reference_bounds_test.cpp numbers_out_of_range_test.cpp)
