/// Reads a whole deck: the block machine over the statements, and what is checked at its end.
#pragma once

#include "input/deck.h"
#include "input/statements.h"

namespace mbcosim {

class DeckReader {
 public:
  DeckReader(Deck& deck, Statements& statements) : deck_(deck), statements_(statements) {}
  /// Reads to the end of the deck. What is wrong goes to the reading's diagnostics.
  void read();

 private:
  enum class Block { none, data, initial_value, control_data, nodes, drivers, elements, foreign };

  void read_statement(const Statement& statement);
  void dispatch(DeckCard& card);
  void begin(DeckCard& card);
  void end(DeckCard& card);
  std::string block_name(int block) const;
  bool is_inverse() const;  ///< is the problem one of inverse dynamics?
  void open(Block block, const std::string& name, SourceSpan where);
  void close();
  void check_order(DeckCard& card, Block block);
  void finish();
  void check_counts();
  void check_parameters();
  void check_initial_value();
  void warn_about_rest(const Statement& last);
  void record(Diagnostic diagnostic, const DeckCard& card);
  std::string_view group_of_cards() const;  ///< of the grammar, for the open block

  Deck& deck_;
  Statements& statements_;
  Block block_ = Block::none;   ///< open now
  Block latest_ = Block::none;  ///< the last block that was begun
  std::string name_;            ///< of the open block as it was written
  SourceSpan begun_;            ///< its `begin`
  bool skipped_ = false;  ///< a block or card of an unknown name: what it defines is not missed
  bool done_ = false;     ///< `end: elements` was read
};

}  // namespace mbcosim
