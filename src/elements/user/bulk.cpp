#include "elements/user/bulk.h"

#include "elements/families.h"
#include "model/card.h"

namespace mbcosim {

namespace {

void read_bulk_spring_support(Card& card, ElementInfo& info) {
  BulkSpringSupport e;
  const SourceSpan where = card.next();
  e.dof = card.node_dof(false);
  if (e.dof.structural && e.dof.component >= 3)
    card.fail_at(where, "spring support: a rotation has no value to be proportional to",
                 "use a deformable hinge");
  if (!e.dof.structural && card.model().scalars[e.dof.node].kind == ScalarKind::parameter)
    card.fail_at(where, "spring support: a parameter node has no equation");
  e.stiffness = card.drive("stiffness");
  add_element(card.builder(), info, std::move(e));
}

}  // namespace

void register_bulk(Registry& registry) {
  registry.typed("bulk", Family::bulk, {"spring support"}, read_bulk_spring_support);
}

}  // namespace mbcosim
