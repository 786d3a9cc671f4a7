/// How elements look to viewers. Each family tells its types in a file of its own; a type that none
/// tells is drawn as a point at each of its structural nodes.
#pragma once

#include <functional>
#include <string>
#include <typeindex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "elements/element_set_of.h"
#include "elements/general_element.h"
#include "model/geometry.h"

namespace mbcosim {

class Drawings {
 public:
  using Draw =
      std::function<void(const ElementSet&, int, const EvalContext&, ElementGeometry& geometry)>;
  using Arrow = std::function<Vec3(const ElementSet&, int, const EvalContext&, int)>;

  /// `draw(element, context, geometry)` for elements of type E.
  template <class E, class Function>
  void add(Function draw) {
    set(typeid(ElementSetOf<E>), [draw](const ElementSet& all, int i, const EvalContext& context,
                                        ElementGeometry& geometry) {
      draw(static_cast<const ElementSetOf<E>&>(all).element(i), context, geometry);
    });
  }
  /// The same function for several types.
  template <class... Es, class Function>
  void add_all(Function draw) {
    (add<Es>(draw), ...);
  }
  /// The same for general elements of type E.
  template <class E, class Function>
  void add_general(Function draw) {
    set(typeid(E), [draw](const ElementSet& all, int i, const EvalContext& context,
                          ElementGeometry& geometry) {
      const GeneralElement& element = static_cast<const GeneralElementSet&>(all).element(i);
      draw(static_cast<const E&>(element), context, geometry);
    });
  }
  /// Loads that viewers draw as arrows: "F" [N], "M" [N·m]; `arrow(element, context, k)` is the
  /// k-th one, global components.
  template <class E, class Function>
  void add_arrows(std::vector<std::string> names, Function arrow) {
    arrows_[typeid(ElementSetOf<E>)] = {
        std::move(names), [arrow](const ElementSet& all, int i, const EvalContext& context, int k) {
          return arrow(static_cast<const ElementSetOf<E>&>(all).element(i), context, k);
        }};
  }
  void set(std::type_index type, Draw draw) { draws_[type] = std::move(draw); }

  void draw(const ElementRef& element, const EvalContext& context, ElementGeometry& geometry) const;
  std::vector<std::string> arrow_names(const ElementRef& element) const;
  /// Zero for an element that is not active.
  Vec3 arrow(const ElementRef& element, const EvalContext& context, int k) const;

 private:
  struct Arrows {
    std::vector<std::string> names;
    Arrow value;
  };
  std::unordered_map<std::type_index, Draw> draws_;
  std::unordered_map<std::type_index, Arrows> arrows_;
};

void draw_beams(Drawings& drawings);
void draw_bodies(Drawings& drawings);
void draw_electric(Drawings& drawings);
void draw_forces(Drawings& drawings);
void draw_hydraulics(Drawings& drawings);
void draw_joints(Drawings& drawings);
void draw_modal(Drawings& drawings);

/// All of the above, once.
const Drawings& all_drawings();

}  // namespace mbcosim
