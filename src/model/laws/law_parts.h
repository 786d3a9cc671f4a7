/// What constitutive laws share: reading vectors and matrices of any dimension, prestress and
/// prestrain.
#pragma once

#include <type_traits>

#include "model/card.h"
#include "model/drive.h"
#include "model/law.h"
#include "model/registry.h"

namespace mbcosim {

// Readers for N = 1, 3 and 6.

/// A scalar, Vec3 or Vec6 argument.
template <int N>
VecN<N> read_law_vector(Card& card, std::string_view what);

/// A scalar, 3×3 or 6×6 argument.
template <int N>
MatN<N> read_law_matrix(Card& card, std::string_view what);

/// `C | proportional, q`: a damping matrix, in the second form q K.
template <int N>
MatN<N> read_damping(Card& card, const MatN<N>& stiffness);
double read_scalar_damping(Card& card, double stiffness);

/// Prestress σ₀ and prestrain ε₀(t): e = ε − ε₀(t), f = σ₀ + law(e, ε̇). The rate of the prestrain
/// is not subtracted.
template <int N>
struct Prestress {
  using StrainDrive = std::conditional_t<N == 1, DrivePtr, TplDrivePtr<N>>;
  VecN<N> stress = VecN<N>::Zero();  ///< σ₀
  StrainDrive strain;                ///< ε₀(t); null: none

  VecN<N> reduced(const EvalContext& context, const VecN<N>& e) const {
    if (!strain) return e;
    if constexpr (N == 1)
      return VecN<1>(e(0) - strain->value(context));
    else
      return e - strain->value(context);
  }
  bool is_null() const { return !strain && stress.isZero(0); }
};

/// `[, prestress, σ₀] [, prestrain, ε₀]`, in this order.
template <int N>
Prestress<N> read_prestress(Card& card);

/// Registers a reader of N-dimensional laws.
template <int N>
void add_law(Registry& registry, std::initializer_list<std::string_view> words,
             Registry::LawReader<N> reader) {
  if constexpr (N == 1)
    registry.law1(words, std::move(reader));
  else if constexpr (N == 3)
    registry.law3(words, std::move(reader));
  else
    registry.law6(words, std::move(reader));
}

constexpr LawType operator|(LawType a, LawType b) {
  return static_cast<LawType>(static_cast<int>(a) | static_cast<int>(b));
}

/// Same law, own memory where it has some.
template <int N>
LawPtr<N> copy_of(const LawPtr<N>& law, ModelBuilder& builder) {
  LawPtr<N> copy = law->has_memory() ? law->copy(builder) : nullptr;
  return copy ? copy : law;
}

// One function per file of this folder.
void register_linear_laws(Registry& registry);
void register_piecewise_laws(Registry& registry);
void register_smooth_laws(Registry& registry);
void register_function_laws(Registry& registry);
void register_bistop_laws(Registry& registry);
void register_shock_absorber(Registry& registry);
void register_composite_laws(Registry& registry);
void register_symbolic_laws(Registry& registry);

}  // namespace mbcosim
