#include "model/laws/law_parts.h"

namespace mbcosim {

template <int N>
VecN<N> read_law_vector(Card& card, std::string_view what) {
  if constexpr (N == 1)
    return VecN<1>(card.real(what));
  else if constexpr (N == 3)
    return card.vec3(what);
  else
    return card.vec6(what);
}

template <int N>
MatN<N> read_law_matrix(Card& card, std::string_view what) {
  if constexpr (N == 1)
    return MatN<1>(card.real(what));
  else if constexpr (N == 3)
    return card.mat3(what);
  else
    return card.mat6(what);
}

template <int N>
MatN<N> read_damping(Card& card, const MatN<N>& stiffness) {
  if (card.keyword("proportional")) return card.real("proportionality factor") * stiffness;
  return read_law_matrix<N>(card, "damping");
}

template <int N>
Prestress<N> read_prestress(Card& card) {
  Prestress<N> p;
  if (card.keyword("prestress")) p.stress = read_law_vector<N>(card, "prestress");
  if (card.keyword("prestrain")) {
    if constexpr (N == 1)
      p.strain = card.scalar_template_drive("prestrain");
    else if constexpr (N == 3)
      p.strain = card.vec3_drive("prestrain");
    else
      p.strain = card.vec6_drive("prestrain");
    if (card.keyword("prestress"))
      card.fail("`prestress` must precede `prestrain`", "swap the two");
  }
  return p;
}

template VecN<1> read_law_vector<1>(Card&, std::string_view);
template VecN<3> read_law_vector<3>(Card&, std::string_view);
template VecN<6> read_law_vector<6>(Card&, std::string_view);
template MatN<1> read_law_matrix<1>(Card&, std::string_view);
template MatN<3> read_law_matrix<3>(Card&, std::string_view);
template MatN<6> read_law_matrix<6>(Card&, std::string_view);
template MatN<1> read_damping<1>(Card&, const MatN<1>&);
template MatN<3> read_damping<3>(Card&, const MatN<3>&);
template MatN<6> read_damping<6>(Card&, const MatN<6>&);
template Prestress<1> read_prestress<1>(Card&);
template Prestress<3> read_prestress<3>(Card&);
template Prestress<6> read_prestress<6>(Card&);

}  // namespace mbcosim
