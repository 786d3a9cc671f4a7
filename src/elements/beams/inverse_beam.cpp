#include "elements/beams/inverse_beam.h"

namespace mbcosim {

namespace {

/// The last of its memory slots.
double& loaded_flag(const ElementSetOf<Beam2>::Slot& slot, State& state) {
  return state.memory[slot.connection.memory + slot.connection.memory_count - 1];
}

}  // namespace

void predict_inverse(const ElementSetOf<Beam2>& beams, int i, const EvalContext& context,
                     State& state) {
  const auto& slot = beams.slot(i);
  Local<double> u;
  beams.gather(context, slot, u);
  const Vec3 r = 0.5 * (u.g(0) + u.g(1)),
             slope = 0.5 * slot.element.point[0].metric * (u.g(1) - u.g(0));
  SectionHistory<double> h(&state.memory[slot.connection.memory]);
  h.R_ref = cgr_rotation(r) * h.R;
  h.k_ref = h.R_ref.transpose() * (cgr_g(r) * slope) + h.k;
  h.w_ref.setZero();
  h.kp_ref.setZero();
  loaded_flag(slot, state) = 1;
}

void unload(const ElementSetOf<Beam2>& beams, int i, State& state) {
  loaded_flag(beams.slot(i), state) = 0;
}

void accept_reference(const ElementSetOf<Beam2>& beams, int i, State& state) {
  SectionHistory<double> h(&state.memory[beams.slot(i).connection.memory]);
  h.R = h.R_ref;
  h.k = h.k_ref;
}

}  // namespace mbcosim
