/// Which words of MBDyn's rarer vocabulary are served, and that every word says how it is written.
#include "input/vocabulary.h"

#include <gtest/gtest.h>

#include "elements/families.h"
#include "input/grammar/grammar.h"

namespace mbcosim::vocabulary_test {
namespace {

const VocabularyWord* find(const std::vector<VocabularyGroup>& groups, const std::string& group,
                           const std::string& word) {
  for (const VocabularyGroup& g : groups)
    if (g.name == group)
      for (const VocabularyWord& w : g.words)
        if (normalized(w.word) == normalized(word)) return &w;
  return nullptr;
}

TEST(Vocabulary, SaysHowEveryServedWordIsWritten) {
  for (const VocabularyGroup& group : vocabulary(full_registry())) {
    if (group.name == "expression function" || group.name == "constant") continue;
    EXPECT_FALSE(group.form.empty()) << group.name;
    for (const VocabularyWord& word : group.words)
      EXPECT_TRUE(!word.served || find_grammar(group.name, word.word))
          << group.name << ": " << word.word << " has no grammar";
  }
}

TEST(Vocabulary, HasAWordForEveryGrammar) {
  const std::vector<VocabularyGroup> groups = vocabulary(full_registry());
  for (const auto& [name, group] : grammars())
    for (const std::string& word : group.written)
      EXPECT_TRUE(find(groups, name, word)) << name << ": no word " << word;
}

TEST(Vocabulary, HasATableOfTheTypesOfEveryHead) {
  const Registry registry = full_registry();
  const std::vector<VocabularyGroup> groups = vocabulary(registry);
  for (const auto& [head, facts] : registry.heads) {
    if (head == "outputelement") continue;  // its two words stand in its own row
    for (const auto& type : facts.types)
      EXPECT_TRUE(find(groups, head, type.key)) << head << ", " << type.key;
  }
}

/// Outside aerodynamics, plates and solids nothing waits.
TEST(Vocabulary, WaitsForAerodynamicsPlatesAndSolidsOnly) {
  for (const VocabularyGroup& group : vocabulary(full_registry()))
    for (const VocabularyWord& word : group.words) {
      if (word.support != "not yet") continue;
      bool known = false;
      for (const char* part : {"aero", "air", "aircraft", "gust", "rotor", "induced", "membrane",
                               "shell", "hookean", "mooney"})
        known = known || word.word.find(part) != std::string::npos;
      EXPECT_TRUE(known) << group.name << ": " << word.word;
    }
}

struct WordStatus {
  const char* group;
  const char* word;
  const char* support;
};

TEST(Vocabulary, ServesWhatIsRealAndRefusesWhatIsDead) {
  const WordStatus words[] = {
      {"block", "inverse dynamics", "yes"},
      {"thermal", "capacitance", "yes"},
      {"thermal", "resistance", "yes"},
      {"thermal", "source", "yes"},
      {"element", "user defined", "yes"},
      {"element", "loadable", "no"},
      {"userdefined", "wheel2", "yes"},
      {"userdefined", "inline friction", "yes"},
      {"userdefined", "asynchronous_machine", "yes"},
      {"userdefined", "imu", "no"},
      {"userdefined", "rigid ring tire", "no"},
      {"joint", "beam slider", "yes"},
      {"joint", "rod bezier", "yes"},
      {"joint", "point contact", "yes"},
      {"joint", "point surface contact", "dead"},
      {"joint", "deformable displacement hinge", "yes"},
      {"joint", "plane displacement", "dead"},
      {"joint", "plane displacement pin", "dead"},
      {"joint", "coincidence", "dead"},
      {"joint", "kinematic", "dead"},
      {"joint", "gimbal hinge", "dead"},
      {"joint", "imposed kinematics", "dead"},
      {"joint", "offset displacement joint", "dead"},
      {"joint", "rotation", "dead"},
      {"joint", "imposed displacement", "yes"},
      {"joint", "imposed displacement pin", "yes"},
      {"joint", "imposed orientation", "yes"},
      {"couple", "absolute", "yes"},
      {"couple", "conservative", "yes"},
      {"couple", "follower", "yes"},
      {"couple", "absolute internal", "yes"},
      {"couple", "conservative internal", "yes"},
      {"couple", "follower internal", "yes"},
      {"couple", "total internal", "yes"},
      {"couple", "absolute displacement", "dead"},
      {"couple", "absolute internal displacement", "dead"},
      {"couple", "abstract", "dead"},
      {"couple", "abstract internal", "dead"},
      {"couple", "modal", "dead"},
      {"couple", "external modal", "dead"},
      {"couple", "external modal mapping", "dead"},
      {"couple", "external structural", "dead"},
      {"couple", "external structural mapping", "dead"},
      {"couple", "total", "dead"},
      {"force", "total internal", "yes"},
      {"force", "external modal", "yes"},
      {"force", "external modal mapping", "yes"},
      {"genel", "spring damper", "dead"},
      {"genel", "spring damper support", "dead"},
      {"genel", "cross spring damper", "dead"},
      {"genel", "cross spring damper support", "dead"},
      {"hydraulic", "full pipe", "dead"},
      {"hydraulic", "full pipe new", "dead"},
      {"hydraulic", "imposed pressure", "dead"},
      {"hydraulic", "imposed flow", "dead"},
      {"hydraulic", "control valve 2", "yes"},
      {"hydraulic", "pressure flow control", "yes"},
      {"law", "linear elastic orthotropic", "dead"},
      {"law", "symbolic elastic isotropic", "dead"},
      {"law", "scalar function viscoelastic isotropic", "dead"},
      {"law", "scalar function viscoelastic orthotropic", "dead"},
      {"law", "hookean linear elastic isotropic", "not yet"},
      {"law", "ann elastic", "no"},
      {"law", "ann viscoelastic", "no"},
      {"law", "tdclw", "no"},
      {"law", "hunt crossley", "no"},
      {"drive", "sh", "dead"},
      {"drive", "octave", "no"},
      {"drive", "derivative", "no"},
      {"drive", "ginac", "no"},
      {"drive", "min", "yes"},
      {"jointregularization", "dynamic", "yes"},
      {"drive", "multi step", "no"},
      {"bulk", "spring support", "yes"},
      {"element", "hbeam", "yes"},
      {"control card", "output results", "partly"},
      {"control card", "print", "yes"},
      {"control card", "make restart file", "ignored"},
      {"control card", "read solution array", "no"},
      {"control card", "output file name", "no"},
      {"control card", "select timeout", "ignored"},
      {"file driver", "stream", "yes"},
      {"file driver", "socket stream", "yes"},
      {"file driver", "RTAI input", "yes"},
      {"element", "stream output", "yes"},
      {"element", "stream motion output", "yes"},
      {"element", "RTAI output", "yes"},
  };
  const std::vector<VocabularyGroup> groups = vocabulary(full_registry());
  for (const WordStatus& w : words) {
    const VocabularyWord* const found = find(groups, w.group, w.word);
    ASSERT_TRUE(found) << w.group << ": " << w.word;
    EXPECT_EQ(found->support, w.support) << w.group << ": " << w.word;
    EXPECT_TRUE(found->support == "yes" || found->support == "not yet" || !found->note.empty())
        << w.group << ": " << w.word << " says no reason";
  }
}

TEST(Grammar, TellsNumbersWithTheirUnits) {
  const WordGrammar* const rod = find_grammar("joint", "rod");
  ASSERT_TRUE(rod);
  const std::vector<GrammarArgument> arguments = grammar_arguments(rod->text);
  ASSERT_EQ(arguments.size(), 1u);
  EXPECT_EQ(arguments[0].name, "length");
  EXPECT_EQ(arguments[0].unit, "m");
}

}  // namespace
}  // namespace mbcosim::vocabulary_test
