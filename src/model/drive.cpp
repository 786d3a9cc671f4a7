#include "model/drive.h"

#include "model/context.h"
#include "model/diagnostic.h"

namespace mbcosim {

double Drive::derivative(const EvalContext&, double) const {
  throw EvaluationError("this drive has no derivative");
}

double Drive::value(const EvalContext& context) const { return value(context, context.time); }

double derivative_in_time(const Drive& drive, const EvalContext& context) {
  return drive.derivative(context, context.time);
}

namespace {

class ConstantDrive : public Drive {
 public:
  explicit ConstantDrive(double value) : value_(value) {}
  using Drive::value;
  double value(const EvalContext&, double) const override { return value_; }
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext&, double) const override { return 0; }

 private:
  double value_;
};

class ConstantVec3Drive : public TplDrive<3, 1> {
 public:
  explicit ConstantVec3Drive(const Vec3& value) : value_(value) {}
  Vec3 value(const EvalContext&) const override { return value_; }
  bool has_derivative() const override { return true; }
  Vec3 derivative(const EvalContext&) const override { return Vec3::Zero(); }

 private:
  Vec3 value_;
};

}  // namespace

DrivePtr make_constant_drive(double value) { return std::make_shared<ConstantDrive>(value); }
Vec3DrivePtr make_constant_vec3_drive(const Vec3& value) {
  return std::make_shared<ConstantVec3Drive>(value);
}

}  // namespace mbcosim
