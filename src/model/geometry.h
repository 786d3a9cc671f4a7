/// What an element looks like, for viewers: points, frames, lines and arrows in terms of nodes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "math/types.h"

namespace mbcosim {

/// Filled by Drawings (elements/drawing.h). Points move with their nodes; everything else hangs on
/// points.
struct ElementGeometry {
  struct Point {
    std::string name;            ///< "point 1", "centre of mass"
    int node = -1;               ///< structural node index; −1: fixed in space
    Vec3 offset = Vec3::Zero();  ///< from the node, node frame; fixed points: position [m]
  };
  /// Axes of a joint: columns of R are axes 1, 2, 3.
  struct Frame {
    std::string name;
    int point = 0;
    Mat3 R = Mat3::Identity();  ///< frame -> node (fixed points: -> global)
  };
  /// Through its points in order: pieces of a straight line, or, `curved`, the polynomial through
  /// three points at ξ = −1, 0, 1: Σ N_k(ξ) x_k with N = ξ(ξ − 1)/2, 1 − ξ², ξ(ξ + 1)/2.
  struct Line {
    std::string name;
    std::vector<int> points;
    bool curved = false;
    std::string variable = {};  ///< that may colour it: "node.hydraulic.3.x"; empty: none
  };
  /// A face between its points, in order around it.
  struct Surface {
    std::string name;
    std::vector<int> points;
  };
  struct Mass {
    int point = 0;                 ///< centre of mass
    double m = 0;                  ///< [kg]
    Vec3 moments = Vec3::Zero();   ///< principal moments about it [kg·m²]
    Mat3 axes = Mat3::Identity();  ///< columns: principal axes, node frame
  };
  /// A load of the element at a point: `sign` times its arrow number `arrow`.
  struct Arrow {
    int point = 0;
    int arrow = 0;  ///< index into Drawings::arrow_names
    int sign = 1;
  };
  /// Points of a flexible body: x + R (f_i + U_i q) with the pose x, R of a node, or fixed.
  struct Modes {
    int node = -1;  ///< structural node index; −1: fixed
    Vec3 x0 = Vec3::Zero();
    Mat3 R0 = Mat3::Identity();
    const std::vector<std::string>* labels = nullptr;  ///< of the points (N)
    const MatX* positions = nullptr;                   ///< f (3 × N) [m]
    const MatX* shapes = nullptr;                      ///< (6N × M), rows 6i … 6i+2 are U_i
    std::vector<std::string> amplitudes;               ///< names of the private data q (M)
  };

  std::vector<Point> points;
  std::vector<Frame> frames;
  std::vector<Line> lines;
  std::vector<Surface> surfaces;
  std::vector<Mass> masses;
  std::vector<Arrow> arrows;
  std::vector<Modes> modes;

  int point(std::string name, int node, const Vec3& offset = Vec3::Zero()) {
    points.push_back({std::move(name), node, offset});
    return static_cast<int>(points.size()) - 1;
  }
  /// A point with axes.
  int frame(std::string name, int node, const Vec3& offset, const Mat3& R) {
    const int at = point(name, node, offset);
    frames.push_back({std::move(name), at, R});
    return at;
  }
  void line(std::string name, std::vector<int> through, bool curved = false) {
    lines.push_back({std::move(name), std::move(through), curved, {}});
  }
};

}  // namespace mbcosim
