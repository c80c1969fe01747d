#include "doppel/description/xacro/detail/text_table.h"

#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <random>
#include <string>

namespace doppel {
namespace {

TEST(TextTable, ContentMatchesMap) {
  const unsigned seed = 20261121;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (const int names : {3, 12, 13, 60, 900}) {
    std::deque<std::string> texts;
    TextTable<int> table;
    std::map<std::string, int> expected;
    for (int step = 0; step < 5000; ++step) {
      const std::string name = "joint_" + std::to_string(random() % static_cast<unsigned>(names));
      if (random() % 4 == 0) {
        table.erase(name);
        expected.erase(name);
      } else {
        table.set(texts.emplace_back(name), step);
        expected[name] = step;
      }
      const std::string other = "joint_" + std::to_string(random() % static_cast<unsigned>(names));
      const int* const found = table.find(other);
      const auto wanted = expected.find(other);
      ASSERT_EQ(found != nullptr, wanted != expected.end()) << other;
      if (found != nullptr) {
        ASSERT_EQ(*found, wanted->second);
      }
    }
  }
}

TEST(TextTable, HashDependsOnEveryCharacter) {
  const std::string text = "the_left_shoulder_pan_joint_of_it";
  for (std::size_t length = 1; length <= text.size(); ++length) {
    const std::string_view whole = std::string_view(text).substr(0, length);
    EXPECT_NE(text_hash(whole), text_hash(whole.substr(0, length - 1)));
    for (std::size_t i = 0; i < length; ++i) {
      std::string other(whole);
      other[i] = '#';
      EXPECT_NE(text_hash(whole), text_hash(other)) << length << " " << i;
    }
  }
}

}  // namespace
}  // namespace doppel
