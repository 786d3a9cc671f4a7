/// Rows that take more than the fixed columns of the text formats.
#pragma once

namespace mbcosim {

/// A writer of a self-describing format derives from this besides OutputRow. An element that can
/// choose its fields
/// (`custom output`) asks for it by dynamic_cast.
class DetailedRow {
 public:
  virtual ~DetailedRow() = default;
};

}  // namespace mbcosim
