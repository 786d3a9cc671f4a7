/// Curves over time, drawn on a terminal or into a picture.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "model/diagnostic.h"

namespace mbcosim::cli {

struct Curve {
  std::string name;
  std::vector<double> x, y;  ///< of the same length
};

/// Draws curves with characters, one for each curve, `columns` × `lines` characters large.
std::string text_chart(const std::vector<Curve>& curves, const std::string& x_name, int columns,
                       int lines);

/// Draws curves into a picture (.png, .svg, .pdf) by gnuplot, or by Python's matplotlib where there
/// is no gnuplot. ErrorKind::io names what is missing.
Status picture(const std::vector<Curve>& curves, const std::string& x_name,
               const std::string& title, const std::string& path);

}  // namespace mbcosim::cli
