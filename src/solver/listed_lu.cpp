#include "solver/listed_lu.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace mbcosim {

namespace {

constexpr int kWorthAligning = 8;  ///< columns of a supernode, or of a diagonal block

int rounded_up(int slot, int to) { return (slot + to - 1) / to * to; }

/// Calls use(k, p) for each number of L below the diagonal, by columns.
template <class Use>
void each_lower(const FactorPattern& f, Use use) {
  for (int k = 0; k < static_cast<int>(f.row_of.size()); ++k)
    for (int p = f.lower_start[k] + 1; p < f.lower_start[k + 1]; ++p) use(k, f.lower_row[p]);
}

/// Calls use(k, row) for each number of U above the diagonal, by columns.
template <class Use>
void each_upper(const FactorPattern& f, Use use) {
  for (int k = 0; k < static_cast<int>(f.row_of.size()); ++k)
    for (int p = f.upper_start[k]; p + 1 < f.upper_start[k + 1]; ++p) use(k, f.upper_row[p]);
}

/// Of each line some numbers.
struct Lines {
  std::vector<int> start, of;
};

/// `all` calls with lines and what they get.
template <class All>
Lines lines_of(int count, All all) {
  Lines lines;
  lines.start.assign(count + 1, 0);
  all([&](int line, int) { ++lines.start[line + 1]; });
  std::partial_sum(lines.start.begin(), lines.start.end(), lines.start.begin());
  lines.of.resize(lines.start.back());
  std::vector<int> next(lines.start.begin(), lines.start.end() - 1);
  all([&](int line, int of) { lines.of[next[line]++] = of; });
  return lines;
}

}  // namespace

void ListedLu::Blocks::add(int slot) {
  if (static_cast<int>(block.size()) > start.back() && block.back() == slot / kBlock) {
    last.back() = slot;
    return;
  }
  block.push_back(slot / kBlock);
  last.push_back(slot);
}

int ListedLu::Blocks::find(int line, int of) const {
  const auto begin = block.begin() + start[line], end = block.begin() + start[line + 1];
  const auto found = std::lower_bound(begin, end, of);
  return found != end && *found == of ? static_cast<int>(found - block.begin()) : -1;
}

/// The programs, of what the constructor has placed.
struct ListedLu::Builder {
  const ListedLu& lu;
  const FactorPattern& factors;
  const MatrixPlaces& matrix;
  const Parts& parts;
  const std::size_t most;
  Lines lower = lines_of(lu.n_, [&](auto use) {  // columns by row of L
    each_lower(factors, [&](int k, int row) { use(row, k); });
  });
  std::vector<int> part_of = parts_of_blocks();
  std::vector<int> column_of{};  ///< by entry of the matrix
  Lines entries = entries_of_lines();

  /// In which order sums of a substitution are taken.
  struct Substitution {
    Lines upper;                    ///< columns by row of U, those of its block, the last first
    std::vector<int> column_above;  ///< by number above the diagonal blocks
    Lines above;                    ///< such numbers by row, those of later blocks first

    explicit Substitution(const Builder& builder)
        : upper(lines_of(builder.lu.n_,
                         [&f = builder.factors, &lu = builder.lu](auto use) {
                           for (int k = lu.n_ - 1; k >= 0; --k)
                             for (int p = f.upper_start[k]; p + 1 < f.upper_start[k + 1]; ++p)
                               if (lu.block_of(f.upper_row[p]) == lu.block_of(k))
                                 use(f.upper_row[p], k);
                         })),
          column_above(builder.matrix.above_row.size()),
          above(lines_of(builder.lu.n_, [&](auto use) {
            const std::vector<int>& block = builder.factors.block_start;
            const MatrixPlaces& matrix = builder.matrix;
            for (std::size_t b = block.size() - 1; b-- > 0;)
              for (int k = block[b]; k < block[b + 1]; ++k)
                for (int p = matrix.above_start[k]; p < matrix.above_start[k + 1]; ++p) {
                  column_above[p] = k;
                  use(matrix.above_row[p], p);
                }
          })) {}
  };

  std::vector<int> parts_of_blocks() const {
    std::vector<int> found(lu.slots_ / kBlock);
    for (int k = 0; k < lu.n_; ++k) found[lu.block_of(k)] = parts.of_column[k];
    return found;
  }
  std::size_t place(const Blocks& blocks, int line, int position) const {
    const int slot = lu.slot_[position];
    return blocks.place(line, blocks.find(line, slot / kBlock)) + slot % kBlock;
  }

  /// Row or column k, those of its blocks that are `wanted`: `inputs` calls with the earlier ones
  /// that update it and with the place of the number by which they are multiplied. The slots that
  /// count are those from `first` on.
  template <class Inputs, class Wanted>
  void update(const Blocks& blocks, int k, int first, std::optional<std::size_t> pivot,
              Inputs inputs, Wanted wanted, EliminationProgram& program) const {
    for (int q = blocks.start[k]; q < blocks.start[k + 1]; ++q) {
      if (!wanted(blocks.block[q])) continue;
      program.begin(blocks.place(k, q), kBlock);
      inputs([&](int i, auto other) {
        const int from = blocks.find(i, blocks.block[q]);
        if (from >= 0 && blocks.last[from] >= first)
          program.subtract_product(blocks.place(i, from), other());
      });
      program.end(pivot);
    }
  }

  /// Calls use(p) for each entry p of the matrix's column k, or above(p, number among all those)
  /// where it is above its diagonal block.
  template <class Use, class Above>
  void each_entry(int k, Use use, Above above) const {
    int next = matrix.above_start[k];
    for (int p = matrix.entry_start[k]; p < matrix.entry_start[k + 1]; ++p)
      if (next < matrix.above_start[k + 1] && matrix.above_row[next] == matrix.entry_row[p])
        above(p, next++);
      else
        use(p);
  }
  Lines entries_of_lines() {
    column_of.resize(matrix.entry_row.size());
    return lines_of(lu.n_, [&](auto use) {
      for (int k = 0; k < lu.n_; ++k)
        each_entry(
            k,
            [&](int p) {
              column_of[p] = k;
              use(std::min(k, matrix.entry_row[p]), p);
            },
            [](int, int) {});
    });
  }

  /// Of the matrix what row k of U and column k of L begin with, and what lies above the diagonal
  /// block in column k.
  void set(int k, EliminationProgram& program) const {
    for (const Blocks* blocks : {&lu.rows_, &lu.columns_})
      program.clear(blocks->first_place[k], static_cast<std::size_t>(kBlock) * blocks->count(k));
    const auto set_entry = [&](std::size_t target, int p, int column) {
      program.set(target, matrix.value_start[column] + p - matrix.entry_start[column],
                  matrix.entry_row[p]);
    };
    for (int q = entries.start[k]; q < entries.start[k + 1]; ++q) {
      const int p = entries.of[q], row = matrix.entry_row[p], column = column_of[p];
      set_entry(row <= column ? place(lu.rows_, row, column) : place(lu.columns_, column, row), p,
                column);
    }
    each_entry(
        k, [](int) {}, [&](int p, int above) { set_entry(above_place(k, above), p, k); });
  }

  /// Of a number of column k above its diagonal block, counted among all of the matrix.
  std::size_t above_place(int k, int above) const {
    return lu.above_place_[k] + (above - matrix.above_start[k]);
  }

  void end_window(EliminationProgram& program) const {
    program.end_window();
    if (program.bytes() > most) throw TooLong();
  }
  void finish(EliminationProgram& program) const {
    end_window(program);
    program.finish();
  }

  /// A part's own are its columns of L and what U has in them. It begins its rows of U.
  EliminationProgram elimination(int part) const {
    EliminationProgram program(lu.numbers_.size());
    for (int k = 0; k < lu.n_; ++k) {
      if (lu.begins_window_[k]) end_window(program);
      if (parts.of_column[k] == part) set(k, program);
      update(
          lu.rows_, k, lu.slot_[k], {},
          [&](auto use) {
            for (int p = lower.start[k]; p < lower.start[k + 1]; ++p)
              use(lower.of[p], [&] { return place(lu.columns_, lower.of[p], k); });
          },
          [&](int block) { return part_of[block] == part; }, program);
      if (parts.of_column[k] != part) continue;
      program.require(lu.pivot_place(k));
      update(
          lu.columns_, k, lu.slot_[k] + 1, lu.pivot_place(k),
          [&](auto use) {
            for (int p = factors.upper_start[k]; p + 1 < factors.upper_start[k + 1]; ++p)
              use(factors.upper_row[p], [&] { return place(lu.rows_, factors.upper_row[p], k); });
          },
          [](int) { return true; }, program);
    }
    finish(program);
    return program;
  }

  std::vector<Stage> substitution() const {
    const Substitution order(*this);
    std::vector<Stage> stages;
    std::optional<EliminationProgram> alone;  // diagonal blocks that one thread does
    const auto close = [&] {
      if (!alone) return;
      finish(*alone);
      stages.emplace_back().push_back(*std::exchange(alone, std::nullopt));
    };
    const auto all = [](int) { return true; };
    for (std::size_t b = factors.block_start.size() - 1; b-- > 0;) {
      const int begin = factors.block_start[b], end = factors.block_start[b + 1];
      if (!is_shared(begin, end)) {
        if (!alone) alone.emplace(lu.numbers_.size());
        eliminate(order, begin, end, all, *alone);
        substitute(order, begin, end, all, *alone);
        continue;
      }
      close();
      const std::vector<int> owner = owners(begin, end);
      const auto each_part = [&](auto of_part) {
        Stage& stage = stages.emplace_back();
        for (int part = 0; part < parts.count; ++part) {
          of_part(part, stage.emplace_back(lu.numbers_.size()));
          finish(stage.back());
        }
      };
      each_part([&](int part, EliminationProgram& program) {
        eliminate(
            order, begin, end, [&](int k) { return owner[k - begin] == part; }, program);
      });
      alone.emplace(lu.numbers_.size());
      eliminate(
          order, begin, end, [&](int k) { return owner[k - begin] == parts.count; }, *alone);
      substitute(
          order, begin, end, [&](int k) { return parts.of_column[k] == parts.count; }, *alone);
      close();
      each_part([&](int part, EliminationProgram& program) {
        substitute(
            order, begin, end, [&](int k) { return parts.of_column[k] == part; }, program);
      });
    }
    close();
    return stages;
  }

  /// Is a diagonal block a large one that has columns of several parts, beside the last?
  bool is_shared(int begin, int end) const {
    constexpr int kLargest = 4;  // may be so many
    if ((end - begin) * std::int64_t{kLargest} < lu.n_) return false;
    std::optional<int> seen;
    for (int k = begin; k < end; ++k) {
      const int part = parts.of_column[k];
      if (part == parts.count) continue;
      if (seen && *seen != part) return true;
      seen = part;
    }
    return false;
  }

  /// Of each position of a diagonal block the part that can take it in x := L⁻¹ x: its own, but the
  /// last one where it needs positions of others. Those of one block of slots go together.
  std::vector<int> owners(int begin, int end) const {
    std::vector<int> owner(end - begin);
    for (int k = begin, after; k < end; k = after) {
      int part = parts.of_column[k];
      for (after = k; after < end && lu.block_of(after) == lu.block_of(k); ++after)
        for (int p = lower.start[after]; p < lower.start[after + 1] && lower.of[p] < k; ++p)
          if (owner[lower.of[p] - begin] != part) part = parts.count;
      std::fill(owner.begin() + (k - begin), owner.begin() + (after - begin), part);
    }
    return owner;
  }

  /// Of a diagonal block the positions that are `wanted`: their right sides, minus what lies above
  /// the diagonal blocks times what has been solved for, then L⁻¹.
  template <class Wanted>
  void eliminate(const Substitution& order, int begin, int end, Wanted wanted,
                 EliminationProgram& program) const {
    for (int k = begin; k < end;) {
      const int first = k;
      for (; k < end && lu.block_of(k) == lu.block_of(first) && wanted(k); ++k) {
        if (lu.begins_window_[k]) end_window(program);
        right_side(order, k, program);
      }
      if (k > first)
        eliminate_block(first, k, program);
      else
        ++k;
    }
  }

  void right_side(const Substitution& order, int k, EliminationProgram& program) const {
    program.set(lu.x(k), factors.row_of[k], k);
    const int after = k + 1 < lu.n_ ? lu.slot_[k + 1] : lu.slots_;
    if (const int padding = after - lu.slot_[k] - 1; padding > 0)
      program.clear(lu.x(k) + 1, static_cast<std::size_t>(padding));
    program.begin(lu.x(k), 1);
    for (int p = order.above.start[k]; p < order.above.start[k + 1]; ++p) {
      const int column = order.column_above[order.above.of[p]];
      program.subtract_product(above_place(column, order.above.of[p]), lu.x(column));
    }
    program.end();
  }

  /// x := U⁻¹ x: a row of U by its blocks, what is padding there being zero, then by its numbers
  /// beside the diagonal.
  template <class Wanted>
  void substitute(const Substitution& order, int begin, int end, Wanted wanted,
                  EliminationProgram& program) const {
    for (int k = end - 1; k >= begin; --k) {
      if (!wanted(k)) continue;
      program.begin(lu.x(k), 1);
      for (int q = lu.rows_.start[k + 1]; --q > lu.rows_.start[k];)
        program.subtract_dot(lu.rows_.place(k, q),
                             lu.x_ + static_cast<std::size_t>(kBlock) * lu.rows_.block[q]);
      const int first = order.upper.start[k], last = order.upper.start[k + 1];
      if (first < last) {
        program.end();
        program.begin(lu.x(k), 1);
      }
      for (int p = first; p < last; ++p)
        program.subtract_product(place(lu.rows_, k, order.upper.of[p]), lu.x(order.upper.of[p]));
      program.end(lu.pivot_place(k));
      if (lu.begins_window_[k]) end_window(program);
    }
  }

  /// x := L⁻¹ x of positions first .. last − 1, which are in one block.
  void eliminate_block(int first, int last, EliminationProgram& program) const {
    const int block = lu.block_of(first);
    std::vector<int>& needed = columns_;
    needed.clear();
    for (int k = first; k < last; ++k)
      for (int p = lower.start[k]; p < lower.start[k + 1] && lower.of[p] < first; ++p)
        needed.push_back(lower.of[p]);
    std::sort(needed.begin(), needed.end());
    needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
    program.begin(lu.x_ + static_cast<std::size_t>(kBlock) * block, kBlock);
    for (const int i : needed)
      program.subtract_product(lu.columns_.place(i, lu.columns_.find(i, block)), lu.x(i));
    program.end();
    for (int row = first; row < last; ++row) {
      program.begin(lu.x(row), 1);
      for (int p = lower.start[row]; p < lower.start[row + 1]; ++p)
        if (const int i = lower.of[p]; i >= first)
          program.subtract_product(place(lu.columns_, i, row), lu.x(i));
      program.end();
    }
  }

  mutable std::vector<int> columns_{};  ///< scratch
};

ListedLu::ListedLu(const FactorPattern& factors, const MatrixPlaces& matrix,
                   const std::vector<int>& supernodes, const Parts& parts, std::size_t most,
                   const PanelVersion& version)
    : n_(static_cast<int>(factors.row_of.size())),
      column_of_(factors.column_of),
      slot_(n_),
      scales_(matrix.inverse_scale),
      version_(version) {
  choose_slots(factors, supernodes, parts);
  find_blocks(factors);
  choose_windows(factors);
  place(matrix);
  each_upper(factors, [&](int k, int row) {
    const int q = rows_.find(row, block_of(k));
    upper_place_.push_back(static_cast<std::uint32_t>(rows_.place(row, q) + slot_[k] % kBlock));
  });
  const Builder builder{*this, factors, matrix, parts, most};
  for (int part = 0; part <= parts.count; ++part) elimination_.push_back(builder.elimination(part));
  of_part_.resize(elimination_.size());
  substitution_ = builder.substitution();
  rows_.last = columns_.last = {};
  count_bytes();
}

/// A block's slots belong to one part, and wide supernodes begin with a block.
void ListedLu::choose_slots(const FactorPattern& factors, const std::vector<int>& supernodes,
                            const Parts& parts) {
  std::vector<char> begins(n_ + 1, 0);
  const auto see = [&](const std::vector<int>& start) {
    for (std::size_t k = 0; k + 1 < start.size(); ++k)
      if (start[k + 1] - start[k] >= kWorthAligning) begins[start[k]] = begins[start[k + 1]] = 1;
  };
  see(supernodes);
  see(factors.block_start);
  for (int k = 0; k < n_; ++k) {
    const bool other_part = k > 0 && parts.of_column[k] != parts.of_column[k - 1];
    if (begins[k] || other_part) slots_ = rounded_up(slots_, kBlock);
    slot_[k] = slots_++;
  }
  slots_ = rounded_up(slots_, kBlock);
}

void ListedLu::find_blocks(const FactorPattern& factors) {
  const Lines columns = lines_of(n_, [&](auto use) {  // by row of U
    each_upper(factors, [&](int k, int row) { use(row, k); });
  });
  for (int k = 0; k < n_; ++k) {
    rows_.start.push_back(static_cast<int>(rows_.block.size()));
    rows_.add(slot_[k]);
    for (int p = columns.start[k]; p < columns.start[k + 1]; ++p) rows_.add(slot_[columns.of[p]]);
    columns_.start.push_back(static_cast<int>(columns_.block.size()));
    for (int p = factors.lower_start[k] + 1; p < factors.lower_start[k + 1]; ++p)
      columns_.add(slot_[factors.lower_row[p]]);
  }
  rows_.start.push_back(static_cast<int>(rows_.block.size()));
  columns_.start.push_back(static_cast<int>(columns_.block.size()));
}

/// Has position b the same blocks as a further on?
bool ListedLu::is_like(int a, int b) const {
  if (slot_[a] % kBlock != slot_[b] % kBlock) return false;
  const int further = block_of(b) - block_of(a);
  for (const Blocks* each : {&rows_, &columns_})
    if (!std::equal(each->block.begin() + each->start[a], each->block.begin() + each->start[a + 1],
                    each->block.begin() + each->start[b], each->block.begin() + each->start[b + 1],
                    [&](int block, int other) { return block + further == other; }))
      return false;
  return true;
}

/// `kWork`: products of blocks that there would be if nothing were missing.
void ListedLu::choose_windows(const FactorPattern& factors) {
  constexpr std::int64_t kWork = 1 << 13;  // at least; twice as much at most
  begins_window_.assign(n_, 0);
  std::int64_t work = 0;
  for (int k = 0, first = 0; k < n_; ++k) {
    const bool inside = k > first && block_of(k) == block_of(k - 1);
    if (!inside && (work >= 2 * kWork || (work >= kWork && is_like(first, k)))) {
      begins_window_[k] = 1;
      first = k;
      work = 0;
    }
    work += std::int64_t{rows_.count(k) + columns_.count(k)} *
            (factors.upper_start[k + 1] - factors.upper_start[k]);
  }
}

/// In each window rows of U, columns of L and what lies above the diagonal blocks. What is solved
/// for comes after all of them: it is short enough for a cache.
void ListedLu::place(const MatrixPlaces& matrix) {
  std::size_t end = 0;
  const auto take = [&](int count) {
    return std::exchange(end, end + static_cast<std::size_t>(rounded_up(count, kBlock)));
  };
  for (int first = 0, last = 0; first < n_; first = last) {
    while (++last < n_ && !begins_window_[last]) {
    }
    for (Blocks* blocks : {&rows_, &columns_})
      for (int k = first; k < last; ++k)
        blocks->first_place.push_back(take(kBlock * blocks->count(k)));
    for (int k = first; k < last; ++k)
      above_place_.push_back(take(matrix.above_start[k + 1] - matrix.above_start[k]));
  }
  x_ = end;
  numbers_.resize(x_ + slots_);
}

bool ListedLu::factor(const double* values, ThreadTeam* team) {
  const int parts = static_cast<int>(elimination_.size()) - 1;
  const auto run = [&](int part, int) {
    of_part_[part] = elimination_[part].run(version_, values, scales_.data(), numbers_.data());
  };
  each_task(team, parts, run);
  if (!std::all_of(of_part_.begin(), of_part_.end() - 1,
                   [](const auto& each) { return each.has_value(); }))
    return false;
  run(parts, 0);
  if (!of_part_[parts]) return false;
  pivots_ = {};
  for (const auto& each : of_part_) {
    pivots_.smallest = std::min(pivots_.smallest, each->smallest);
    pivots_.largest = std::max(pivots_.largest, each->largest);
  }
  return true;
}

void ListedLu::solve(double* b, ThreadTeam* team) {
  for (const Stage& stage : substitution_)
    each_task(team, static_cast<int>(stage.size()), [&](int program, int) {
      (void)stage[program].run(version_, b, scales_.data(), numbers_.data());
    });
  for (int k = 0; k < n_; ++k) b[column_of_[k]] = numbers_[x(k)];
}

bool ListedLu::pivots_dominate(double bound) const {
  for (int k = 0; k < n_; ++k)
    for (int q = columns_.start[k]; q < columns_.start[k + 1]; ++q)
      for (int i = 0; i < kBlock; ++i)
        if (columns_.block[q] * kBlock + i > slot_[k] &&
            !(std::abs(numbers_[columns_.place(k, q) + i]) <= bound))
          return false;
  return true;
}

void ListedLu::count_bytes() {
  for (const EliminationProgram& program : elimination_) bytes_ += program.bytes();
  for (const Stage& stage : substitution_)
    for (const EliminationProgram& program : stage) bytes_ += program.bytes();
  bytes_ += sizeof(double) * numbers_.size() + sizeof(std::uint32_t) * upper_place_.size() +
            2 * sizeof(int) * (rows_.block.size() + columns_.block.size());
}

}  // namespace mbcosim
