#include "model/word_table.h"

#include <gtest/gtest.h>

#include <thread>

namespace mbcosim::word_table_test {
namespace {

std::vector<std::string> keys(const WordTable<int>& table) {
  std::vector<std::string> found;
  for (const auto& entry : table) found.push_back(entry.key);
  return found;
}

TEST(WordTable, FindsWordsAsTheLanguageComparesThem) {
  WordTable<int> table;
  EXPECT_TRUE(table.empty());
  EXPECT_EQ(table.find("rod"), nullptr);
  table.add("rod", 1);
  table.add("state space SISO", 2);
  table.add("distance", 3);
  EXPECT_FALSE(table.empty());
  ASSERT_NE(table.find("statespacesiso"), nullptr);
  EXPECT_EQ(table.find("statespacesiso")->value, 2);
  EXPECT_EQ(table.find("statespacesiso")->word, "state space SISO");
  EXPECT_EQ(table.find("state space SISO"), nullptr);
  EXPECT_EQ(table.find("ro"), nullptr);
  EXPECT_EQ(table.find("rods"), nullptr);
  EXPECT_EQ(keys(table), (std::vector<std::string>{"distance", "rod", "statespacesiso"}));
}

TEST(WordTable, TheLastMeaningCounts) {
  WordTable<int> table;
  table.add("rod", 1);
  table.add("pin", 2);
  table.add("ROD", 3);
  EXPECT_EQ(table.find("rod")->value, 3);
  EXPECT_EQ(table.find("rod")->word, "ROD");
  table.add("r o d", 4);  // after it was looked at
  EXPECT_EQ(table.find("rod")->value, 4);
  EXPECT_EQ(keys(table), (std::vector<std::string>{"pin", "rod"}));
}

TEST(WordTable, ACopyGoesItsOwnWay) {
  WordTable<int> table;
  table.add("rod", 1);
  WordTable<int> copy = table;
  copy.add("pin", 2);
  EXPECT_EQ(copy.find("rod")->value, 1);
  EXPECT_EQ(copy.find("pin")->value, 2);
  EXPECT_EQ(table.find("pin"), nullptr);
}

TEST(WordTable, ManyMayBeTheFirstToLook) {
  WordTable<int> table;
  const char* const words[] = {"rod", "pin", "clamp", "screw", "brake", "modal"};
  for (int k = 0; k < 6; ++k) table.add(words[k], k);
  std::vector<int> found(8, -1);
  std::vector<std::thread> readers;
  for (int& value : found)
    readers.emplace_back([&table, &value] { value = table.find("brake")->value; });
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(found, std::vector<int>(8, 4));
}

}  // namespace
}  // namespace mbcosim::word_table_test
