set(SOURCES model.cpp model_builder.cpp registry.cpp drive.cpp output_row.cpp node_data.cpp card.cpp)
