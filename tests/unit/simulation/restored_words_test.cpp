/// Every word of the registry in a run that is restored, in the same simulation and in another one
/// that reads the state's bytes: each goes on with the same bits.
#include <gtest/gtest.h>

#include "input/word_cards.h"
#include "simulation/simulation.h"

namespace mbcosim::restored_words_test {
namespace {

using decks::Bench;
using decks::WordCard;

class RestoredWord : public testing::TestWithParam<WordCard> {
 protected:
  static std::unique_ptr<Simulation> start() {
    LoadReport report = load_deck(BundleSource(word_deck(GetParam(), Bench::moving)), "deck.mbd");
    for (const Diagnostic& d : report.diagnostics)
      if (d.severity == Severity::error) ADD_FAILURE() << d.text();
    if (!report.ok()) return nullptr;
    auto created = Simulation::create(report.model);
    if (!created) ADD_FAILURE() << created.error().message;
    return created ? std::move(*created) : nullptr;
  }
  /// The bytes of the state after `count` more steps.
  static std::string after(Simulation& simulation, int count) {
    const StepReport report = simulation.step_many(count);
    EXPECT_FALSE(report.error) << report.error->message;
    return simulation.export_state();
  }
};

TEST_P(RestoredWord, GoesOnWithTheSameBits) {
  const auto run = start(), other = start();
  ASSERT_TRUE(run && other);
  const std::string saved = after(*run, 3);
  const State snapshot = run->snapshot();
  const std::string expected = after(*run, 4);
  ASSERT_TRUE(saved != expected);

  ASSERT_TRUE(run->restore(snapshot));
  EXPECT_TRUE(run->export_state() == saved);
  EXPECT_TRUE(after(*run, 4) == expected) << "restored in the same simulation";

  ASSERT_TRUE(other->import_state(saved));
  EXPECT_TRUE(after(*other, 4) == expected) << "from the bytes, in another simulation";
}

INSTANTIATE_TEST_SUITE_P(Named, RestoredWord, testing::ValuesIn(decks::numbered_word_cards()),
                         [](const auto& info) { return decks::test_name(info.param); });

}  // namespace
}  // namespace mbcosim::restored_words_test
