/// Matrices that map the motion of a model's nodes to what an external code sees.
#pragma once

#include "elements/ports/mapping_matrix.h"
#include "model/card.h"

namespace mbcosim {

/// `{full | sparse} mapping file, [threshold, t,] "file"`: numbers by rows, or lines `row column
/// value` counted from 1; values of modulus up to the threshold are 0. `rows` −1: as many as the
/// file has, `step` at a time.
MappingMatrix read_mapping_file(Card& card, int rows, int columns, int step);

/// Numbers of a text; lines that start with # are comments. `lines`: those with numbers.
std::vector<double> read_mapping_numbers(Card& card, const std::string& text, std::size_t* lines);

}  // namespace mbcosim
