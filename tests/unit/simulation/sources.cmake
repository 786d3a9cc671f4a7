set(SOURCES threads_test.cpp chosen_steps_test.cpp adaptive_control_test.cpp beam_decks_test.cpp beam_proofs_test.cpp discrete_control_test.cpp identification_test.cpp electric_decks_test.cpp
    flexible_refusals_test.cpp genel_decks_test.cpp
    deck_details_test.cpp failed_evaluations_test.cpp reference_differences_test.cpp rigid_body_test.cpp pendulums_test.cpp
    spinning_test.cpp mechanisms_test.cpp private_data_test.cpp reference_decks_test.cpp state_bytes_test.cpp stick_slip_test.cpp dry_friction_test.cpp imposed_joints_test.cpp inverse_dynamics_test.cpp reference_conventions_test.cpp reference_rules_test.cpp variable_mass_test.cpp measured_beams_test.cpp rotating_shaft_test.cpp geometry_view_test.cpp user_elements_test.cpp recomputed_loads_test.cpp restored_words_test.cpp)
