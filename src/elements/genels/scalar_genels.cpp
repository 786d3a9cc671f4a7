#include "elements/genels/scalar_genels.h"

namespace mbcosim {

void GenelClamp::start(Start& s) const {
  const int k = unknown_of(s.u.model(), dof);
  if (k < 0) return;
  (dof.order == 0 ? s.state.y : s.state.yp)[k] = s.u.drive(d);
}

void GenelClamp::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::gen, u.label());
  row.scalar("lambda", "", u.own(0));
  row.end();
}

void GenelDistance::start(Start& s) const {
  if (second.structural) return;
  const int k = unknown_of(s.u.model(), second);
  (second.order == 0 ? s.state.y : s.state.yp)[k] = s.u.dof(l1) + s.u.drive(d);
}

void GenelDistance::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::gen, u.label());
  row.scalar("lambda", "", u.own(0));
  row.end();
}

void GenelSpring::after_predict(const Local<double>& u, State& state) const {
  if (law->has_memory())
    law->after_predict(*u.context, state, Strain(u.dof(l2) - u.dof(l1)), Strain(0.0));
}
void GenelSpring::after_convergence(const Local<double>& u, State& state) const {
  if (law->has_memory())
    law->after_convergence(*u.context, state, Strain(u.dof(l2) - u.dof(l1)), Strain(0.0));
}

void GenelSpringSupport::after_predict(const Local<double>& u, State& state) const {
  if (law->has_memory())
    law->after_predict(*u.context, state, Strain(dof_position(u, l) - x0), Strain(dof_rate(u, l)));
}
void GenelSpringSupport::after_convergence(const Local<double>& u, State& state) const {
  if (law->has_memory())
    law->after_convergence(*u.context, state, Strain(dof_position(u, l) - x0),
                           Strain(dof_rate(u, l)));
}

}  // namespace mbcosim
