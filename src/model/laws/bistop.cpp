// Laws that drives switch on and off. Their flag and reference strain live in State::memory.
#include "model/laws/law_parts.h"
#include "model/laws/linear.h"
#include "model/model.h"

namespace mbcosim {

namespace {

struct Switches {
  bool initially_active = false;
  bool captures_strain = true;
  DrivePtr on, off;
};

Switches read_switches(Card& card) {
  Switches s;
  if (card.keyword("initial status")) {
    const int word = card.one_of({"inactive", "active"});
    s.initially_active = word >= 0 ? word == 1 : card.yes_no("initial status");
    if (card.keyword("capture reference strain"))
      s.captures_strain = card.yes_no("capture reference strain");
  }
  s.on = card.drive("activation condition");
  s.off = card.drive("deactivation condition");
  return s;
}

/// Passes the strain since its activation on to another law while active; gives nothing else.
///
/// The status changes once a step, with the predicted strain: on ≠ 0 activates and takes ε as
/// reference, off ≠ 0 deactivates. Memory: status, ε_ref (N).
template <int N>
class Bistop : public Law<N> {
 public:
  using V = VecN<N>;

  Bistop(ModelBuilder& builder, Switches switches, LawPtr<N> law)
      : switches_(std::move(switches)),
        law_(std::move(law)),
        memory_(builder.allocate_memory(1 + N)) {
    builder.set_memory(memory_, switches_.initially_active ? 1 : 0);
  }
  LawType type() const override { return law_->type(); }
  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               typename Law<N>::Response& r) const override {
    const double* memory = &context.state->memory[memory_];
    if (memory[0] != 0) return law_->respond(context, strain - V(memory + 1), rate, tangent, r);
    r.f.setZero();
    r.de.setZero();
    r.dep.setZero();
  }
  void after_predict(const EvalContext& context, State& state, const V& strain,
                     const V& rate) const override {
    double* memory = &state.memory[memory_];
    if (memory[0] == 0 && switches_.on->value(context) != 0) {
      memory[0] = 1;
      if (switches_.captures_strain) Eigen::Map<V>(memory + 1) = strain;
    } else if (memory[0] != 0 && switches_.off->value(context) != 0) {
      memory[0] = 0;
    }
    law_->after_predict(context, state, strain - V(memory + 1), rate);
  }
  void after_convergence(const EvalContext& context, State& state, const V& strain,
                         const V& rate) const override {
    law_->after_convergence(context, state, strain - V(&state.memory[memory_ + 1]), rate);
  }
  bool has_memory() const override { return true; }
  LawPtr<N> copy(ModelBuilder& builder) const override {
    return std::make_shared<Bistop>(builder, switches_, copy_of(law_, builder));
  }

 private:
  Switches switches_;
  LawPtr<N> law_;
  int memory_;
};

/// `k [, c], <conditions> [, prestress] [, prestrain]`.
template <int N, LawType type>
LawPtr<N> read_linear_bistop(Card& card) {
  const double k = card.real("stiffness");
  const double c = type == LawType::elastic ? 0 : card.real("damping");
  Switches s = read_switches(card);
  const MatN<N> unit = MatN<N>::Identity();
  auto law = std::make_shared<LinearLaw<N>>(type, k * unit, c * unit, read_prestress<N>(card));
  return std::make_shared<Bistop<N>>(card.builder(), std::move(s), std::move(law));
}

template <int N>
LawPtr<N> read_bistop_law(Card& card) {
  Switches s = read_switches(card);
  LawPtr<N> law = card.template law<N>();
  return std::make_shared<Bistop<N>>(card.builder(), std::move(s), std::move(law));
}

template <int N>
void register_bistop(Registry& r) {
  add_law<N>(r, {"linear elastic bistop"}, read_linear_bistop<N, LawType::elastic>);
  add_law<N>(r, {"linear viscoelastic bistop"}, read_linear_bistop<N, LawType::viscoelastic>);
  add_law<N>(r, {"bistop"}, read_bistop_law<N>);
}

}  // namespace

void register_bistop_laws(Registry& r) {
  register_bistop<1>(r);
  register_bistop<3>(r);
  register_bistop<6>(r);
}

}  // namespace mbcosim
