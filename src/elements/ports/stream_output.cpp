#include "elements/ports/stream_output.h"

namespace mbcosim {

void StreamOutput::outputs(const GeneralView& u, std::vector<double>& out) const {
  for (const Value& value : values_)
    out.push_back(value.drive ? u.drive(value.drive) : u.dof(value.dof));
  const auto put = [&](const auto& m) { out.insert(out.end(), m.data(), m.data() + m.size()); };
  for (const int n : nodes_) {
    const NodeState node = u.node(n);
    const Mat3 transposed =
        node.R.transpose();  // columns are stored one after the other: this writes R by rows
    for (const Motion motion : motion_) {
      switch (motion) {
        case Motion::position:
          put(node.x);
          break;
        case Motion::orientation:
          put(transposed);
          break;
        case Motion::transposed_orientation:
          put(node.R);
          break;
        case Motion::velocity:
          put(node.v);
          break;
        case Motion::angular_velocity:
          put(node.w);
          break;
      }
    }
  }
}

}  // namespace mbcosim
