/// Eigen's dynamic matrices, safe where memory is refused.
///
/// Eigen 3.4 frees a matrix before it asks for memory of its new size. Where that is refused, as by
/// a daemon whose budget is used up or whose call was cancelled, the matrix keeps a pointer to what
/// it has freed, and frees it again in its destructor. Here such a matrix is empty instead.
///
/// Included by math/types.h, and by what uses Eigen's types without that.
#pragma once

#include <Eigen/Core>
#include <type_traits>

static_assert(EIGEN_WORLD_VERSION == 3, "see whether Eigen still frees before it allocates");

namespace mbcosim::detail {

/// An option that Eigen has no use for.
constexpr int kEigensOwn = 0x100;
/// Not of indices: Eigen's headers have those before this one.
template <class T, int kOptions>
constexpr bool is_emptied = kOptions < kEigensOwn && !std::is_same_v<T, Eigen::Index>;

/// `Storage`: Eigen's, of matrices whose size changes.
template <class Storage>
class EmptiedStorage : public Storage {
 public:
  using Storage::Storage;
  void resize(Eigen::Index size, Eigen::Index rows, Eigen::Index columns) {
    if (size != this->rows() * this->cols()) {
      Storage freed;
      freed.swap(*this);
    }
    Storage::resize(size, rows, columns);
  }
};

template <class T, int kRows, int kColumns, int kOptions>
using EmptiedStorageOf =
    EmptiedStorage<Eigen::DenseStorage<T, Eigen::Dynamic, kRows, kColumns, kOptions | kEigensOwn>>;

}  // namespace mbcosim::detail

namespace Eigen {

// Version 14 does not know `requires`.
// clang-format off

template <class T, int kOptions>
  requires(mbcosim::detail::is_emptied<T, kOptions>)
class DenseStorage<T, Dynamic, Dynamic, Dynamic, kOptions>
    : public mbcosim::detail::EmptiedStorageOf<T, Dynamic, Dynamic, kOptions> {
  using Base = mbcosim::detail::EmptiedStorageOf<T, Dynamic, Dynamic, kOptions>;

 public:
  using Base::Base;
};

template <class T, int kRows, int kOptions>
  requires(mbcosim::detail::is_emptied<T, kOptions>)
class DenseStorage<T, Dynamic, kRows, Dynamic, kOptions>
    : public mbcosim::detail::EmptiedStorageOf<T, kRows, Dynamic, kOptions> {
  using Base = mbcosim::detail::EmptiedStorageOf<T, kRows, Dynamic, kOptions>;

 public:
  using Base::Base;
};

template <class T, int kColumns, int kOptions>
  requires(mbcosim::detail::is_emptied<T, kOptions>)
class DenseStorage<T, Dynamic, Dynamic, kColumns, kOptions>
    : public mbcosim::detail::EmptiedStorageOf<T, Dynamic, kColumns, kOptions> {
  using Base = mbcosim::detail::EmptiedStorageOf<T, Dynamic, kColumns, kOptions>;

 public:
  using Base::Base;
};

// clang-format on

}  // namespace Eigen
