/// What can be drawn of a model: points, lines, frames and masses in terms of its nodes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mbcosim::client {

/// Lengths in the deck's unit, matrices by rows; indices from 0.
struct Geometry {
  using Vector = std::array<double, 3>;
  using Matrix3 = std::array<double, 9>;

  struct Node {
    int label = 0;
    std::string kind, name;              ///< "dynamic"; the deck's name
    Vector position = {};                ///< global
    std::optional<Matrix3> orientation;  ///< node frame to global; none: offsets are global
    int position_handle = 0;             ///< of the variable
    std::optional<int> orientation_handle;
  };
  /// Fixed to a node, or in space.
  struct Point {
    std::string name;
    std::optional<int> node;  ///< label; none: fixed in space
    Vector offset = {};       ///< in the node's frame; fixed points: the position
    Vector position = {};     ///< at `step`, global
  };
  /// Axes at a point; hinges turn about axis 3.
  struct Frame {
    std::string name;
    int point = 0;             ///< index into the element's points
    Matrix3 orientation = {};  ///< to the frame of the point's node; columns are the axes
  };
  struct Line {
    std::string name;
    std::vector<int> points;  ///< indices into the element's points
    bool curved = false;      ///< the parabola through three points
    std::vector<Vector> trace;
    std::optional<int> value_handle;  ///< of a variable that may colour it
  };
  struct Surface {
    std::string name;
    std::vector<int> points;  ///< around the face
  };
  /// For an ellipsoid of inertia.
  struct Mass {
    int point = 0;  ///< its centre
    double mass = 0;
    Vector principal_moments = {};
    Matrix3 principal_axes = {};  ///< columns, in the frame of the point's node
  };
  /// A load at a point.
  struct Arrow {
    int point = 0, handle = 0;
    bool reversed = false, moment = false;
  };
  struct Element {
    std::string family, type, name;
    int label = 0;
    std::vector<Point> points;
    std::vector<Frame> frames;
    std::vector<Line> lines;
    std::vector<Surface> surfaces;
    std::vector<Mass> masses;
    std::vector<Arrow> arrows;
  };
  /// Points of a modal joint: x + R (f + Σ U q) with the pose of its node and amplitudes q.
  struct FlexibleBody {
    int joint = 0;            ///< label
    std::optional<int> node;  ///< label; none: fixed at `position`, `orientation`
    Vector position = {};
    Matrix3 orientation = {};
    std::vector<int> amplitude_handles;  ///< one for each mode
    std::vector<std::string> labels;     ///< of the FEM nodes
    std::vector<Vector> points;          ///< f
    std::vector<double> shapes;          ///< U by rows, (3 × modes) for each point
  };

  std::string model_digest;
  std::int64_t step = 0;
  double time = 0;
  std::optional<Vector> lower, upper;  ///< corners of a box around the nodes
  std::vector<Node> nodes;
  std::vector<Element> elements;
  std::vector<FlexibleBody> flexible_bodies;
};

struct GeometryOptions {
  std::optional<int> line_samples = {};  ///< points of each curved line's trace, 2 to 1000
  bool modal_points = true;              ///< of flexible bodies, which are large
};

}  // namespace mbcosim::client
