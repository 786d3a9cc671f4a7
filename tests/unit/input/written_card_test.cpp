#include "input/written_card.h"

#include <algorithm>

#include "deck_fixture.h"
#include "simulation/load.h"

namespace mbcosim::decks::written_card_test {
namespace {

const char* const kNodes = "structural: 1, dynamic, null, eye, null, null;";

DeckReport read(const DeckText& deck, std::map<std::string, std::string> others = {}) {
  others["deck.mbd"] = deck.text();
  DeckReport report = read_deck(BundleSource(std::move(others)), "deck.mbd", {});
  EXPECT_TRUE(report.ok()) << findings(report.diagnostics);
  return report;
}

std::optional<WrittenCard> card_of(const DeckReport& report, Family family, int label,
                                   std::size_t most = 1000) {
  const ElementRef element = report.model->find_element(family, label);
  return written_card(report.files, element.set->info(element.index).where, most);
}

DeckText with(const std::string& elements) {
  DeckText deck;
  deck.nodes = kNodes;
  deck.elements = elements;
  return deck;
}

TEST(WrittenCard, IsTheTextUpToItsSemicolonWithCommentsAndLines) {
  const std::string card =
      "body: 3, name, \"a; b\", 1, # kg; not the end\n    2., null, /* ; */\n    diag, 1., (2. + "
      "0.), 3.;";
  const DeckText deck = with("# first\n  " + card + " # x");
  const DeckReport report = read(deck);
  ASSERT_TRUE(report.ok());
  const std::optional<WrittenCard> written = card_of(report, Family::body, 3);
  ASSERT_TRUE(written);
  EXPECT_EQ(written->text, card);
  EXPECT_EQ(written->file, "deck.mbd");
  EXPECT_EQ(written->column, 3);
  const std::string before = deck.text().substr(0, deck.text().find("body: 3"));
  EXPECT_EQ(written->line, 1 + std::count(before.begin(), before.end(), '\n'));
  EXPECT_FALSE(written->cut);
}

TEST(WrittenCard, NamesTheIncludedFile) {
  const DeckReport report =
      read(with("include: \"arm.inc\";"), {{"arm.inc", "\n\nbody: 3, 1, 2., null, eye;"}});
  ASSERT_TRUE(report.ok());
  const std::optional<WrittenCard> written = card_of(report, Family::body, 3);
  ASSERT_TRUE(written);
  EXPECT_EQ(written->file, "arm.inc");
  EXPECT_EQ(written->line, 3);
  EXPECT_EQ(written->text, "body: 3, 1, 2., null, eye;");
}

TEST(WrittenCard, OfANodeAndOfWhatADrivenCardHolds) {
  const DeckReport report = read(with("driven: 3, const, 1., body: 3, 1, 2., null, eye;"));
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(written_card(report.files, report.model->structural[0].where, 1000)->text, kNodes);
  EXPECT_EQ(card_of(report, Family::body, 3)->text, "body: 3, 1, 2., null, eye;");
}

TEST(WrittenCard, IsCutAtTheEndOfALine) {
  const DeckReport report = read(with("body: 3, 1,\n  2.,\n  null, eye;"));
  ASSERT_TRUE(report.ok());
  const std::optional<WrittenCard> written = card_of(report, Family::body, 3, 18);
  ASSERT_TRUE(written);
  EXPECT_EQ(written->text, "body: 3, 1,\n  2.,");
  EXPECT_TRUE(written->cut);
}

TEST(WrittenCard, IsNoneWhereTheDeckHasNone) {
  const DeckReport report = read(with(""));
  ASSERT_TRUE(report.ok());
  EXPECT_FALSE(written_card(report.files, SourceSpan{}, 1000));
}

}  // namespace
}  // namespace mbcosim::decks::written_card_test
