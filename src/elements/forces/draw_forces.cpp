#include "elements/drawing.h"
#include "elements/forces/structural_force.h"

namespace mbcosim {

namespace {

Mat3 orientation(const EvalContext& context, int node) {
  return context.model->node_state(context, node).R;
}

/// The value of a drive, which follows a node or not.
Vec3 vector(const EvalContext& context, const Vec3DrivePtr& d, bool follower, int node) {
  const Vec3 value = d->value(context);
  return follower ? Vec3(orientation(context, node) * value) : value;
}

template <class E>
void draw_at_one_node(Drawings& d, const char* name) {
  d.add<E>([](const E& e, const EvalContext&, ElementGeometry& g) {
    g.arrows.push_back({g.point("point", e.node, e.a), 0, 1});
  });
  d.add_arrows<E>({name}, [](const E& e, const EvalContext& context, int) {
    return vector(context, e.d, e.follower, e.node);
  });
}

template <class E>
void draw_between_nodes(Drawings& d, const char* name) {
  d.add<E>([](const E& e, const EvalContext&, ElementGeometry& g) {
    g.arrows.push_back({g.point("point 1", e.first, e.a1), 0, 1});
    g.arrows.push_back({g.point("point 2", e.second, e.a2), 0, -1});
  });
  d.add_arrows<E>({name}, [](const E& e, const EvalContext& context, int) {
    return vector(context, e.d, e.follower, e.first);
  });
}

/// Force and moment along axes of `node`.
template <class E>
Vec3 total_load(const E& e, const EvalContext& context, int node, int k) {
  const Vec3 load = k == 0 ? Vec3(e.Rf * e.df->value(context)) : Vec3(e.Rm * e.dm->value(context));
  return orientation(context, node) * load;
}

void draw_total_forces(Drawings& d) {
  d.add<TotalForce>([](const TotalForce& e, const EvalContext&, ElementGeometry& g) {
    const int at = g.point("point", e.node, e.f);
    for (const int k : {0, 1}) g.arrows.push_back({at, k, 1});
  });
  d.add_arrows<TotalForce>({"F", "M"}, [](const TotalForce& e, const EvalContext& context, int k) {
    return total_load(e, context, e.node, k);
  });
  d.add<TotalInternalForce>(
      [](const TotalInternalForce& e, const EvalContext&, ElementGeometry& g) {
        const int one = g.point("point 1", e.first), two = g.point("point 2", e.second, e.f2);
        for (const int k : {0, 1}) {
          g.arrows.push_back({one, k, 1});
          g.arrows.push_back({two, k, -1});
        }
      });
  d.add_arrows<TotalInternalForce>(
      {"F", "M"}, [](const TotalInternalForce& e, const EvalContext& context, int k) {
        return total_load(e, context, e.first, k);
      });
}

}  // namespace

void draw_forces(Drawings& d) {
  draw_at_one_node<StructuralForce>(d, "F");
  draw_at_one_node<StructuralCouple>(d, "M");
  draw_between_nodes<InternalForce>(d, "F");
  draw_between_nodes<InternalCouple>(d, "M");
  draw_total_forces(d);
}

}  // namespace mbcosim
