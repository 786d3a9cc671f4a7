#include "elements/forces/abstract_force.h"

namespace mbcosim {

int label_of(const Model& model, const NodeDof& dof) {
  return dof.structural ? model.structural[dof.node].label : model.scalars[dof.node].label;
}

void AbstractForce::output(const Local<double>& u, OutputRow& row) const {
  const double f = u.drive(d);
  row.begin(OutputFile::frc, u.label());
  row.integer(label_of(u.model(), first));
  row.scalar("f", "", f);
  if (internal) {
    row.integer(label_of(u.model(), second));
    row.scalar("f2", "", -f);
  }
  row.end();
}

}  // namespace mbcosim
