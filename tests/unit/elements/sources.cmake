set(SOURCES ports_test.cpp mapped_modal_test.cpp mapped_points_test.cpp)
list(APPEND SOURCES registered_elements_test.cpp beam_test.cpp body_tangent_test.cpp external_structural_test.cpp force_test.cpp
    genel_test.cpp hydraulic_circuit_test.cpp joint_conformance_test.cpp hydraulic_actuator_test.cpp
    joint_reference_test.cpp friction_conformance_test.cpp
    hydraulic_beam_test.cpp hydraulic_fluid_test.cpp hydraulic_orifice_test.cpp
    hydraulic_physics_test.cpp hydraulic_pipe_test.cpp hydraulic_refusal_test.cpp
    hydraulic_valve_test.cpp fem_data_test.cpp modal_deck_test.cpp modal_joint_test.cpp
    modal_node_body_test.cpp modal_refusal_test.cpp joint_motions_test.cpp joint_input_test.cpp variable_body_test.cpp user_conformance_test.cpp)
