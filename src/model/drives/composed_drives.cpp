#include "model/drives/composed_drives.h"

#include <algorithm>
#include <cmath>

#include "model/model.h"
#include "model/nested_evaluation.h"

namespace mbcosim {

double ProductDrive::value(const EvalContext& context, double t) const {
  return f_->value(context, t) * g_->value(context, t);
}
double ProductDrive::value(const EvalContext& context) const {
  return f_->value(context) * g_->value(context);
}
double ProductDrive::derivative(const EvalContext& context, double t) const {
  return f_->derivative(context, t) * g_->value(context, t) +
         f_->value(context, t) * g_->derivative(context, t);
}
void ProductDrive::collect_followed(std::vector<NodeDof>& dofs) const {
  f_->collect_followed(dofs);
  g_->collect_followed(dofs);
}
void ProductDrive::write_slopes(const EvalContext& context, double factor, double*& next) const {
  f_->write_slopes(context, factor * g_->value(context), next);
  g_->write_slopes(context, factor * f_->value(context), next);
}

namespace {

bool all_have_derivatives(const std::vector<DrivePtr>& parts) {
  return std::all_of(parts.begin(), parts.end(),
                     [](const DrivePtr& f) { return f->has_derivative(); });
}

}  // namespace

double SumDrive::value(const EvalContext& context, double t) const {
  double sum = 0;
  for (const DrivePtr& f : parts_) sum += f->value(context, t);
  return sum;
}
double SumDrive::value(const EvalContext& context) const {
  double sum = 0;
  for (const DrivePtr& f : parts_) sum += f->value(context);
  return sum;
}
bool SumDrive::has_derivative() const { return all_have_derivatives(parts_); }
double SumDrive::derivative(const EvalContext& context, double t) const {
  double sum = 0;
  for (const DrivePtr& f : parts_) sum += f->derivative(context, t);
  return sum;
}
void SumDrive::collect_followed(std::vector<NodeDof>& dofs) const {
  for (const DrivePtr& f : parts_)
    if (dofs.size() <= kMaxFollowed) f->collect_followed(dofs);
}
void SumDrive::write_slopes(const EvalContext& context, double factor, double*& next) const {
  for (const DrivePtr& f : parts_) f->write_slopes(context, factor, next);
}

double ExtremeDrive::value(const EvalContext& context, double t) const {
  double extreme = parts_[0]->value(context, t);
  for (const DrivePtr& f : parts_)
    if (const double v = f->value(context, t); beats(v, extreme)) extreme = v;
  return extreme;
}
double ExtremeDrive::value(const EvalContext& context) const {
  double extreme = parts_[0]->value(context);
  for (const DrivePtr& f : parts_)
    if (const double v = f->value(context); beats(v, extreme)) extreme = v;
  return extreme;
}
bool ExtremeDrive::has_derivative() const { return all_have_derivatives(parts_); }
double ExtremeDrive::derivative(const EvalContext& context, double t) const {
  const Drive* extreme = parts_[0].get();
  for (const DrivePtr& f : parts_)
    if (beats(f->value(context, t), extreme->value(context, t))) extreme = f.get();
  return extreme->derivative(context, t);
}

double ChainDrive::value(const EvalContext& context, double t) const {
  return f_->value(context, g_->value(context, t));
}
double ChainDrive::value(const EvalContext& context) const {
  return f_->value(context, g_->value(context));
}
double ChainDrive::derivative(const EvalContext& context, double t) const {
  return f_->derivative(context, g_->value(context, t)) * g_->derivative(context, t);
}
void ChainDrive::collect_followed(std::vector<NodeDof>& dofs) const {
  if (f_->has_slope()) g_->collect_followed(dofs);
}
void ChainDrive::write_slopes(const EvalContext& context, double factor, double*& next) const {
  if (f_->has_slope())
    g_->write_slopes(context, factor * f_->slope(context, g_->value(context)), next);
}

double PeriodicDrive::value(const EvalContext& context, double t) const {
  return t < t0_ ? 0 : f_->value(context, std::fmod(t - t0_, period_));
}
double PeriodicDrive::derivative(const EvalContext& context, double t) const {
  return t < t0_ ? 0 : f_->derivative(context, std::fmod(t - t0_, period_));
}

const Drive& PostponedDrive::target(const EvalContext& context) const {
  const NamedDrive* const found = context.model->find_drive(label_);
  if (!found)
    throw EvaluationError("postponed drive: there is no drive caller " + std::to_string(label_));
  NestedEvaluation::charge(found->evaluations);
  return *found->drive;
}
double PostponedDrive::value(const EvalContext& context, double t) const {
  const NestedEvaluation nested;
  return target(context).value(context, t);
}
double PostponedDrive::value(const EvalContext& context) const {
  const NestedEvaluation nested;
  return target(context).value(context);
}
double PostponedDrive::derivative(const EvalContext& context, double t) const {
  const NestedEvaluation nested;
  const Drive& drive = target(context);
  return drive.has_derivative() ? drive.derivative(context, t) : 0;
}

double DofDrive::value(const EvalContext& context, double t) const { return f_->value(context, t); }
double DofDrive::value(const EvalContext& context) const {
  return f_->value(context, context.model->dof_value(context, dof_));
}
void DofDrive::collect_followed(std::vector<NodeDof>& dofs) const {
  if (f_->has_slope()) dofs.push_back(dof_);
}
void DofDrive::write_slopes(const EvalContext& context, double factor, double*& next) const {
  if (f_->has_slope())
    *next++ = factor * f_->slope(context, context.model->dof_value(context, dof_));
}

double ScalarNodeDrive::value(const EvalContext& context, double) const {
  return f_->value(context, context.model->dof_value(context, datum_));
}
void ScalarNodeDrive::collect_followed(std::vector<NodeDof>& dofs) const {
  if (f_->has_slope()) dofs.push_back(datum_);
}
void ScalarNodeDrive::write_slopes(const EvalContext& context, double factor, double*& next) const {
  if (f_->has_slope())
    *next++ = factor * f_->slope(context, context.model->dof_value(context, datum_));
}

double NodeDrive::value(const EvalContext& context, double) const {
  return f_->value(context, context.model->structural_datum_value(context, node_, datum_));
}
void NodeDrive::collect_followed(std::vector<NodeDof>& dofs) const {
  const auto dof = Model::dof_of_structural_datum(node_, datum_);
  if (dof && f_->has_slope()) dofs.push_back(*dof);
}
void NodeDrive::write_slopes(const EvalContext& context, double factor, double*& next) const {
  if (!Model::dof_of_structural_datum(node_, datum_) || !f_->has_slope()) return;
  const double argument = context.model->structural_datum_value(context, node_, datum_);
  *next++ = factor * f_->slope(context, argument);
}

double ElementDrive::value(const EvalContext& context, double) const {
  const NestedEvaluation nested;
  return f_->value(context, element_.set->private_value(context, element_.index, datum_));
}

}  // namespace mbcosim
