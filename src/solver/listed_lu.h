/// LU of matrices of one pattern by lists of operations: where factors are narrow, loops over a few
/// numbers cost more than arithmetic.
///
/// L by columns and U by rows are computed by turns (Crout): an update of a row of U takes the
/// number of L and the row of U from each column before, an update of a column of L a number of U
/// and the column of L, so that none of those that are updated together needs another one of them.
/// Rows and columns of the factors are cut into blocks of four, at the same slots in all of them:
/// what is side by side in one update has been stored together by an earlier one. Numbers that a
/// block has for slots without a place in the pattern are padding. They are zero, as whatever makes
/// one of them another number would have given it a place, but for those before the diagonal in the
/// block of the diagonal, which take part in nothing.
///
/// Positions are cut into windows whose numbers lie together. A window begins, where that can be,
/// with a position that has the same blocks as the one with which the last window began.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "math/thread_team.h"
#include "solver/elimination_program.h"
#include "solver/factor_pattern.h"

namespace mbcosim {

class ListedLu {
 public:
  /// Columns that threads may take apart: those of part p need others of p only, but for the last
  /// part, which comes after all others.
  struct Parts {
    std::vector<int> of_column;  ///< (n)
    int count = 0;               ///< but for the last one
  };
  /// Thrown when a list takes more bytes than it may.
  struct TooLong {};
  /// `matrix`: as long as this. `supernodes`: first column of each, then n. `most`: bytes of a
  /// list. Throws TooLong.
  ListedLu(const FactorPattern& factors, const MatrixPlaces& matrix,
           const std::vector<int>& supernodes, const Parts& parts, std::size_t most,
           const PanelVersion& version);

  /// False when a pivot vanishes or is not a number: there are no factors then.
  bool factor(const double* values, ThreadTeam* team);
  /// Solves in place.
  void solve(double* b, ThreadTeam* team);

  double pivot_ratio() const { return pivots_.smallest / pivots_.largest; }
  double pivot(int k) const { return numbers_[pivot_place(k)]; }
  /// Number p of U, counted by columns without the pivots.
  double upper(int p) const { return numbers_[upper_place_[p]]; }
  /// Whether no number of L is beyond the bound.
  bool pivots_dominate(double bound) const;
  std::size_t bytes() const { return bytes_; }  ///< of memory

 private:
  static constexpr int kBlock = EliminationProgram::kBlock;

  /// Blocks of the rows of U or of the columns of L.
  struct Blocks {
    std::vector<int> start;  ///< of each row or column, then all
    std::vector<int> block;  ///< slot / kBlock, ascending
    std::vector<int> last;   ///< the last slot in the pattern; until the lists are made
    std::vector<std::size_t> first_place;  ///< of each row or column
    void add(int slot);
    int count(int line) const { return start[line + 1] - start[line]; }
    std::size_t place(int line, int q) const {  ///< of block q, one of the line's
      return first_place[line] + static_cast<std::size_t>(kBlock) * (q - start[line]);
    }
    int find(int line, int of) const;  ///< −1: it has none
  };
  using Stage = std::vector<EliminationProgram>;  ///< at the same time
  struct Builder;

  int block_of(int k) const { return slot_[k] / kBlock; }
  std::size_t pivot_place(int k) const { return rows_.first_place[k] + slot_[k] % kBlock; }
  std::size_t x(int k) const { return x_ + slot_[k]; }
  void choose_slots(const FactorPattern& factors, const std::vector<int>& supernodes,
                    const Parts& parts);
  void find_blocks(const FactorPattern& factors);
  void choose_windows(const FactorPattern& factors);
  bool is_like(int a, int b) const;
  void place(const MatrixPlaces& matrix);
  void count_bytes();

  int n_, slots_ = 0;
  std::vector<int> column_of_;
  std::vector<int> slot_;            ///< by position, ascending
  Blocks rows_;                      ///< of U, with the pivots
  Blocks columns_;                   ///< of L
  std::vector<char> begins_window_;  ///< by position
  std::vector<std::uint32_t> upper_place_;
  std::vector<std::size_t> above_place_;  ///< of each column's numbers above its diagonal block
  std::size_t x_ = 0;                     ///< first place of what is solved for, by slot
  const std::vector<double>& scales_;     ///< of the matrix's places
  std::vector<double> numbers_;
  std::vector<EliminationProgram> elimination_;                    ///< by part
  std::vector<std::optional<EliminationProgram::Sizes>> of_part_;  ///< pivots
  EliminationProgram::Sizes pivots_;
  std::vector<Stage> substitution_;  ///< one after the other
  std::size_t bytes_ = 0;
  const PanelVersion& version_;
};

}  // namespace mbcosim
