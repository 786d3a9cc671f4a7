/// Drives made of other drives, of scalar functions and of the model's state.
///
/// Source: MBDyn input manual, "Drive callers". "In time" (`value(context)`) the parts are
/// evaluated in time, too, so that run-time strings see no argument.
#pragma once

#include <string>
#include <vector>

#include "model/drive.h"
#include "model/drives/file_driver.h"
#include "model/element_set.h"
#include "model/node.h"
#include "model/scalar_function.h"

namespace mbcosim {

/// f g.
class ProductDrive : public Drive {
 public:
  ProductDrive(DrivePtr f, DrivePtr g) : f_(std::move(f)), g_(std::move(g)) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  bool has_derivative() const override { return f_->has_derivative() && g_->has_derivative(); }
  double derivative(const EvalContext& context, double t) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, double factor, double*& next) const override;

 private:
  DrivePtr f_, g_;
};

/// Σ fₖ.
class SumDrive : public Drive {
 public:
  explicit SumDrive(std::vector<DrivePtr> parts) : parts_(std::move(parts)) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  bool has_derivative() const override;
  double derivative(const EvalContext& context, double t) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, double factor, double*& next) const override;

 private:
  std::vector<DrivePtr> parts_;
};

/// The smallest or the largest of fₖ; the first of those that are equal.
class ExtremeDrive : public Drive {
 public:
  ExtremeDrive(std::vector<DrivePtr> parts, bool largest)
      : parts_(std::move(parts)), largest_(largest) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  bool has_derivative() const override;
  double derivative(const EvalContext& context, double t) const override;

 private:
  bool beats(double a, double b) const { return largest_ ? a > b : a < b; }

  std::vector<DrivePtr> parts_;
  bool largest_;
};

/// f(g(t)).
class ChainDrive : public Drive {
 public:
  ChainDrive(DrivePtr f, DrivePtr g) : f_(std::move(f)), g_(std::move(g)) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  bool has_derivative() const override { return f_->has_derivative() && g_->has_derivative(); }
  double derivative(const EvalContext& context, double t) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, double factor, double*& next) const override;

 private:
  DrivePtr f_, g_;
};

/// 0 before t0, then f((t − t0) mod T).
class PeriodicDrive : public Drive {
 public:
  PeriodicDrive(double t0, double period, DrivePtr f)
      : t0_(t0), period_(period), f_(std::move(f)) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return f_->has_derivative(); }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, period_;
  DrivePtr f_;
};

/// What `postponed` drives name, and where: a ModelPart.
struct PostponedLabels {
  std::vector<std::pair<int, SourceSpan>> labels;
};

/// The drive caller with a label, looked up when it is evaluated. Its derivative is 0 when that
/// drive has none.
class PostponedDrive : public Drive {
 public:
  explicit PostponedDrive(int label) : label_(label) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  const Drive& target(const EvalContext& context) const;
  int label_;
};

class ScalarFunctionDrive : public Drive {
 public:
  explicit ScalarFunctionDrive(ScalarFunctionPtr f) : f_(std::move(f)) {}
  using Drive::value;
  double value(const EvalContext&, double t) const override { return f_->value(t); }
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext&, double t) const override { return f_->derivative(t); }

 private:
  ScalarFunctionPtr f_;
};

/// A · channel of a file driver in time, whatever the argument.
class FileDrive : public Drive {
 public:
  FileDrive(FileDriverPtr driver, int channel, double amplitude)
      : driver_(std::move(driver)), channel_(channel), amplitude_(amplitude) {}
  using Drive::value;
  double value(const EvalContext& context, double) const override {
    return amplitude_ * driver_->value(context, channel_, context.time);
  }

 private:
  FileDriverPtr driver_;
  int channel_;  ///< from 0
  double amplitude_;
};

/// In time f(value of a degree of freedom).
///
/// N.B. where a drive gives it an argument t it is f(t): MBDyn's convention.
class DofDrive : public Drive {
 public:
  DofDrive(const NodeDof& dof, DrivePtr f) : dof_(dof), f_(std::move(f)) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, double factor, double*& next) const override;

 private:
  NodeDof dof_;
  DrivePtr f_;
};

/// f(private datum of a scalar node), whatever the argument.
class ScalarNodeDrive : public Drive {
 public:
  ScalarNodeDrive(const NodeDof& datum, DrivePtr f) : datum_(datum), f_(std::move(f)) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, double factor, double*& next) const override;

 private:
  NodeDof datum_;
  DrivePtr f_;
};

/// f(private datum of a structural node), whatever the argument.
class NodeDrive : public Drive {
 public:
  NodeDrive(int node, int datum, DrivePtr f) : node_(node), datum_(datum), f_(std::move(f)) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  void collect_followed(std::vector<NodeDof>& dofs) const override;
  void write_slopes(const EvalContext& context, double factor, double*& next) const override;

 private:
  int node_, datum_;
  DrivePtr f_;
};

/// f(private datum of an element), whatever the argument.
class ElementDrive : public Drive {
 public:
  ElementDrive(ElementRef element, int datum, DrivePtr f)
      : element_(element), datum_(datum), f_(std::move(f)) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;

 private:
  ElementRef element_;
  int datum_;
  DrivePtr f_;
};

}  // namespace mbcosim
