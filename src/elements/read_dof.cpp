#include "elements/read_dof.h"

#include "model/model.h"

namespace mbcosim {

NodeDof read_equation_dof(Card& card, const char* what) {
  const SourceSpan where = card.next();
  const NodeDof dof = card.node_dof(true);
  const auto refuse = [&](const std::string& why) {
    card.fail_at(where, std::string(what) + ": " + why);
  };
  if (!dof.structural && card.model().scalars[dof.node].kind == ScalarKind::parameter)
    refuse("a parameter node has no equation");
  if (dof.structural && card.model().structural[dof.node].is_dummy())
    refuse("a dummy node has no equations");
  if (dof.structural && dof.component >= 6)
    refuse("only components 1 to 6 of a structural node are accepted");
  if (dof.order > 1) refuse("second derivatives are not accepted");
  if (dof.structural && dof.component >= 3 && dof.order == 0)
    refuse("the value of a rotation is not defined; write `differential`");
  return dof;
}

NodeDof read_value_dof(Card& card, const char* what) {
  const SourceSpan where = card.next();
  const NodeDof dof = read_equation_dof(card, what);
  if (dof.order != 0)
    card.fail_at(where, std::string(what) + ": the dof's own value is needed", "write `algebraic`");
  return dof;
}

}  // namespace mbcosim
