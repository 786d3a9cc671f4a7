#include "model/node_equations.h"

#include "math/types.h"
#include "model/state.h"

namespace mbcosim {

void NodeEquations::bind(const std::vector<StructuralNode>& nodes) {
  rows_.clear();
  for (const StructuralNode& node : nodes)
    if (node.has_momentum()) rows_.push_back({node.first, node.has_rotation(), 0});
}

void NodeEquations::collect_pattern(PatternSink& sink) const {
  for (const Row& row : rows_) {
    const int n = row.rotation ? 6 : 3;
    for (int i = 0; i < n; ++i) {
      const int column = row.first + n + i;
      const int momentum = row.first + i;
      sink.block(&momentum, 1, &column, 1);
      sink.block(&column, 1, &column, 1);
    }
    if (!row.rotation) continue;
    const int balance[3] = {row.first + 9, row.first + 10, row.first + 11};
    const int x[3] = {row.first, row.first + 1, row.first + 2};
    const int b[3] = {row.first + 6, row.first + 7, row.first + 8};
    sink.block(balance, 3, x, 3);
    sink.block(balance, 3, b, 3);
  }
}

void NodeEquations::append_rows(int k, std::vector<int>& rows) const {
  const int count = rows_[k].rotation ? 12 : 6;
  for (int i = 0; i < count; ++i) rows.push_back(rows_[k].first + i);
}

void NodeEquations::set_positions(const PositionSource& source) {
  positions_.clear();
  for (Row& row : rows_) {
    row.position = static_cast<int>(positions_.size());
    const int n = row.rotation ? 6 : 3;
    for (int i = 0; i < n; ++i) {
      positions_.push_back(source.position(row.first + i, row.first + n + i));
      positions_.push_back(source.position(row.first + n + i, row.first + n + i));
    }
    if (!row.rotation) continue;
    for (const int start : {row.first, row.first + 6})
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
          positions_.push_back(source.position(row.first + 9 + i, start + j));
  }
}

void NodeEquations::residual(const EvalContext& context, double* r, ElementRange range) const {
  const std::vector<double>&y = context.state->y, &yp = context.state->yp;
  for (int k = range.first; k < range.last; ++k) {
    const Row& row = rows_[k];
    const int n = row.rotation ? 6 : 3;
    for (int i = 0; i < n; ++i) {
      r[row.first + i] += y[row.first + n + i];
      r[row.first + n + i] -= yp[row.first + n + i];
    }
    if (!row.rotation) continue;
    const Vec3 vxb = vector_at(yp, row.first).cross(vector_at(y, row.first + 6));
    for (int i = 0; i < 3; ++i) r[row.first + 9 + i] -= vxb(i);
  }
}

void NodeEquations::jacobian(const EvalContext& context, double* values, ElementRange range) const {
  const std::vector<double>&y = context.state->y, &yp = context.state->yp;
  for (int k = range.first; k < range.last; ++k) {
    const Row& row = rows_[k];
    const int n = row.rotation ? 6 : 3;
    const int* p = &positions_[row.position];
    for (int i = 0; i < n; ++i) {
      values[*p++] -= context.seed;
      values[*p++] += 1;
    }
    if (!row.rotation) continue;
    const Mat3 by_x = -cross<double>(vector_at(y, row.first + 6));
    const Mat3 by_b = context.seed * cross<double>(vector_at(yp, row.first));
    for (int k = 0; k < 9; ++k) values[*p++] += by_x(k);
    for (int k = 0; k < 9; ++k) values[*p++] += by_b(k);
  }
}

}  // namespace mbcosim
