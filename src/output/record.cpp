#include "output/record.h"

#include <algorithm>

#include "model/drive_trace.h"
#include "model/inverse_problem.h"

namespace mbcosim {

namespace {

void write_structural(const EvalContext& context, int index, OutputRow& row) {
  const StructuralNode& node = context.model->structural[index];
  const NodeState s = context.model->node_state(context, index);
  row.begin(OutputFile::mov, node.label);
  row.vec3("X", "m", s.x);
  if (node.is_displacement())
    row.vec3("Phi", "rad", Vec3::Zero());
  else
    row.orientation("R", s.R, node.description);
  row.vec3("XP", "m/s", s.v);
  row.vec3("Omega", "rad/s", s.w);
  if (node.accelerations && (node.has_momentum() || node.kind == StructuralKind::modal ||
                             node.is_dummy() || inverse_problem(*context.model))) {
    const NodeAcceleration a = context.model->node_acceleration(context, index);
    row.vec3("XPP", "m/s^2", a.a);
    row.vec3("OmegaP", "rad/s^2", a.wp);
  }
  row.end();
}

void write_inertia(const EvalContext& context, int index, OutputRow& row) {
  const StructuralNode& node = context.model->structural[index];
  const int p = node.position_unknowns();
  const double *y = &context.state->y[node.first + p], *yp = &context.state->yp[node.first + p];
  const auto vec = [](const double* v) { return Vec3(v[0], v[1], v[2]); };
  row.begin(OutputFile::ine, node.label);
  row.vec3("B", "kg m/s", vec(y));
  row.vec3("G", "kg m^2/s", p == 6 ? vec(y + 3) : Vec3(Vec3::Zero()));
  row.vec3("BP", "N", vec(yp));
  row.vec3("GP", "N m", p == 6 ? vec(yp + 3) : Vec3(Vec3::Zero()));
  row.end();
}

void write_scalar(const EvalContext& context, const ScalarNode& node, OutputRow& row) {
  static constexpr OutputFile kFile[] = {OutputFile::abs, OutputFile::ele, OutputFile::prs,
                                         OutputFile::thn, OutputFile::prm};
  row.begin(kFile[static_cast<int>(node.kind)], node.label);
  NodeDof dof;
  dof.node = static_cast<int>(&node - context.model->scalars.data());
  row.scalar("x", kind_unit(node.kind), context.model->dof_value(context, dof));
  if (node.kind != ScalarKind::parameter && node.kind != ScalarKind::hydraulic &&
      node.differential) {
    dof.order = 1;
    row.scalar("xP", "", context.model->dof_value(context, dof));
  }
  row.end();
}

void write_drive(const EvalContext& context, OutputFile file, int label, const Drive& drive,
                 bool value, bool derivative, OutputRow& row) {
  if (!value && !derivative) return;
  row.begin(file, label);
  if (value) row.scalar("value", "", drive.value(context));
  if (derivative && drive.has_derivative())
    row.scalar("derivative", "", derivative_in_time(drive, context));
  row.end();
}

void write_drives(const EvalContext& context, OutputRow& row) {
  for (const NamedDrive& d : context.model->drives)
    write_drive(context, OutputFile::drv, d.label, *d.drive, d.output_value, d.output_derivative,
                row);
}

}  // namespace

void write_traces(const EvalContext& context, OutputRow& row) {
  const DriveTraces* traces = find_part<DriveTraces>(*context.model);
  if (!traces) return;
  for (const DriveTraces::Trace& t : traces->traces)
    write_drive(context, OutputFile::trc, t.label, *t.drive, t.value, t.derivative, row);
}

void write_record(const EvalContext& context, OutputRow& row) {
  const Model& model = *context.model;
  for (std::size_t k = 0; k < model.structural.size(); ++k)
    if (model.structural[k].output) write_structural(context, static_cast<int>(k), row);
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    const StructuralNode& n = model.structural[k];
    if (n.output && n.output_inertia && n.has_momentum())
      write_inertia(context, static_cast<int>(k), row);
  }
  for (const ScalarNode& node : model.scalars)
    if (node.output) write_scalar(context, node, row);
  for (const ElementRef& e : model.printed)
    if (e.set->is_active(*context.state, e.index)) e.set->output(context, e.index, row);
  if (model.gravity && model.gravity->uniform && model.gravity->output) {
    row.begin(OutputFile::grv, model.gravity->label);
    row.vec3("a", "m/s^2", context.uniform_gravity);
    row.end();
  }
  write_drives(context, row);
}

void write_reference_frames(const Model& model, OutputRow& row) {
  std::vector<const ReferenceFrame*> frames;
  for (const ReferenceFrame& f : model.frames) frames.push_back(&f);
  std::sort(frames.begin(), frames.end(),
            [](const auto* a, const auto* b) { return a->label < b->label; });
  for (const ReferenceFrame* f : frames) {
    row.begin(OutputFile::rfm, f->label);
    row.vec3("X", "m", f->x);
    row.orientation("R", f->R, model.control.orientation);
    row.vec3("V", "m/s", f->v);
    row.vec3("W", "rad/s", f->w);
    row.end();
  }
}

}  // namespace mbcosim
