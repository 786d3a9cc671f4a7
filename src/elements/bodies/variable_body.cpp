#include "elements/bodies/variable_body.h"

#include "elements/bodies/body.h"
#include "elements/log_text.h"

namespace mbcosim {

VariableInertia VariableBody::inertia(const EvalContext& context, int label) const {
  VariableInertia p;
  p.m = m->value(context);
  if (!(p.m > 0)) {
    char text[100];
    std::snprintf(text, sizeof text, "body %d: the mass is %.6g kg at time %.6g s", label, p.m,
                  context.time);
    throw EvaluationError(text);
  }
  p.m_rate = derivative_in_time(*m, context);
  p.b = b->value(context);
  p.b_rate = b->derivative(context);
  p.J_vm = J_vm->value(context);
  p.J_vm_rate = J_vm->derivative(context);
  p.J_vg = J_vg->value(context);
  p.J_vg_rate = J_vg->derivative(context);
  return p;
}

namespace {

/// d²/dt² by a central difference, for output; zero where the drive has no value on one side.
Vec3 second_derivative(const TplDrive<3, 1>& drive, EvalContext context) {
  const double time = context.time, delta = context.h > 0 ? 1e-2 * context.h : 1e-6;
  try {
    context.time = time + delta;
    const Vec3 after = drive.derivative(context);
    context.time = time - delta;
    return (after - drive.derivative(context)) / (2 * delta);
  } catch (const EvaluationError&) {
    return Vec3::Zero();
  }
}

}  // namespace

void VariableBody::add_inertia(const Local<double>& u, int node_index, Inertia& sum) const {
  if (node_index != node) return;
  const VariableInertia p = inertia(*u.context, u.label());
  const Vec3 arm = u.R(0) * p.b;
  const Vec3 relative = u.R(0) * p.b_rate, w = u.w(0), local_w = u.R(0).transpose() * w;
  const Mat3 arm_x = cross<double>(arm);
  sum.m += p.m;
  sum.S += p.m * arm;
  sum.J += u.R(0) * p.J() * u.R(0).transpose() - p.m * arm_x * arm_x;
  sum.b += p.m * relative;
  sum.g += p.m * arm.cross(relative);
  const Vec3 velocity = u.v(0) + w.cross(arm) + relative;
  const Vec3 rate = p.m_rate * velocity +
                    p.m * (2 * w.cross(relative) + u.R(0) * second_derivative(*b, *u.context));
  sum.b_rate += rate;
  sum.g_rate += u.R(0) * ((p.J_vm_rate + p.J_vg_rate) * local_w) + arm.cross(rate);
}

std::string VariableBody::log(const Model& model, int label) const {
  return "variable body:" + log_integers({label, model.structural[node].label}) +
         log_values({initial.m}) + log_vector(initial.b) + log_matrix(initial.J_vm) +
         log_matrix(initial.J_vg);
}

int VariableBody::private_datum(std::string_view name) { return Body::private_datum(name); }
std::vector<Datum> VariableBody::private_data() { return Body::private_data(); }

double VariableBody::private_value(const Local<double>& u, int datum) const {
  const VariableInertia p = inertia(*u.context, u.label());
  if (datum == 2) return p.m;
  const Vec3 arm = u.R(0) * p.b;
  if (datum == 1) return -p.m * u.model().gravity_at(*u.context, u.x(0)).dot(u.x(0) + arm);
  const Vec3 velocity = u.v(0) + u.w(0).cross(arm) + u.R(0) * p.b_rate;
  const Vec3 w = u.R(0).transpose() * u.w(0);
  return 0.5 * p.m * velocity.squaredNorm() + 0.5 * w.dot(p.J() * w);
}

}  // namespace mbcosim
