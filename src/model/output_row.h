/// What elements and nodes print. The writers in `output/` turn rows into MBDyn's text files or
/// NetCDF variables.
#pragma once

#include <string_view>

#include "math/rotation.h"
#include "math/types.h"

namespace mbcosim {

/// Result files by MBDyn's extension.
enum class OutputFile {
  mov,
  ine,
  jnt,
  frc,
  act,
  prs,
  hyd,
  mod,
  abs,
  gen,
  ele,
  prm,
  grv,
  thn,
  the,
  aer,
  rot,
  air,
  pla,
  usr,
  rfm,
  drv,
  trc,
  ext,
  count
};

const char* extension(OutputFile file);  ///< "mov", ...

/// Receives one line at a time: begin, fields in column order, end. Names and units serve
/// self-describing formats; the text writer ignores them.
class OutputRow {
 public:
  virtual ~OutputRow() = default;
  /// Does the format name its fields, so that elements may choose them (`custom output`)? The text
  /// formats have fixed columns.
  virtual bool has_named_fields() const { return false; }
  /// Starts the line of `label`, right-aligned in 8 columns (not padded in .frc).
  virtual void begin(OutputFile file, int label) = 0;
  /// Starts a line with a composite label that is written as it is, e.g. "      10.1" in .mod,
  /// "3@7" in .frc.
  virtual void begin_text(OutputFile file, std::string_view label) = 0;
  virtual void integer(int value) = 0;
  virtual void scalar(const char* name, const char* unit, double value) = 0;
  virtual void vec3(const char* name, const char* unit, const Vec3& value) = 0;
  virtual void values(const char* name, const char* unit, const double* data, int count) = 0;
  virtual void end() = 0;

  /// An orientation in the given description: degrees for Euler angles, radians for the vector, 9
  /// numbers by rows.
  void orientation(const char* name, const Mat3& r, OrientationDescription description);
  /// The twelve standard columns of a joint: local force and moment, global force and moment [N,
  /// N·m].
  void reactions(const Vec3& f, const Vec3& m, const Vec3& big_f, const Vec3& big_m);
};

}  // namespace mbcosim
