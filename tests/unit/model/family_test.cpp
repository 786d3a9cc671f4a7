#include "model/family.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "elements/families.h"

namespace mbcosim::family_test {
namespace {

TEST(Family, EveryWordOfADeckLeadsToOneFamily) {
  std::set<std::string_view> heads, functions, files;
  for (const FamilyFacts& f : all_families()) {
    EXPECT_EQ(&family_facts(f.family), &f);
    EXPECT_FALSE(f.heads.empty()) << f.name;
    for (const std::string_view head : f.heads) {
      EXPECT_TRUE(heads.insert(head).second) << head;
      EXPECT_EQ(family_by_head(head), &f) << head;
      EXPECT_EQ(normalized(head), head);
    }
    for (const std::string_view word : f.functions) {
      EXPECT_TRUE(functions.insert(word).second) << word;
      EXPECT_EQ(family_by_function(word), &f) << word;
    }
    for (const std::string_view file : f.files) {
      EXPECT_TRUE(files.insert(file).second) << file;
      EXPECT_EQ(family_by_file(file), &f) << file;
    }
    EXPECT_EQ(f.files.empty(), std::string_view(f.owner).empty()) << f.name;
  }
}

TEST(Family, WhatIsServedIsOfTheFamilyThatTheTableSays) {
  for (const auto& [word, head] : full_registry().heads) {
    const FamilyFacts* const family = family_by_head(word);
    ASSERT_NE(family, nullptr) << word;
    EXPECT_EQ(family->family, head.family) << word;
  }
}

TEST(Family, UnknownWordsLeadToNone) {
  EXPECT_EQ(family_by_head("bodies"), nullptr);
  EXPECT_EQ(family_by_function("beam2"), nullptr);
  EXPECT_EQ(family_by_file("mov"), nullptr);
}

}  // namespace
}  // namespace mbcosim::family_test
