set(SOURCES beam_decks_test.cpp rigid_body_test.cpp)
