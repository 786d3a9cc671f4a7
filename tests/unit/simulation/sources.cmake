set(SOURCES beam_decks_test.cpp beam_proofs_test.cpp deck_details_test.cpp reference_differences_test.cpp rigid_body_test.cpp)
