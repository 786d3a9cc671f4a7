set(SOURCES assembly_plan.cpp check.cpp diagnostic.cpp family.cpp model.cpp model_builder.cpp registry.cpp drive.cpp element_set.cpp node_equations.cpp output_row.cpp node_data.cpp node_momenta.cpp card.cpp
    beam_output.cpp deck_channel.cpp sampled_table.cpp state.cpp unit_system.cpp)
