#include "doppel/description/xacro/condition.h"

#include <gtest/gtest.h>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

constexpr const char* kState =
    "header:\n  stamp:\n    sec: 3\n    nanosec: 0\n  frame_id: base\nname:\n- a\n- b\nposition:\n- 0.25\n- "
    "-1.5\n";

TEST(Condition, FieldOfListIsCompared) {
  EXPECT_TRUE(Condition("m.position[0] > 0.2", "m").holds(kState));
  EXPECT_FALSE(Condition("m.position[1] > 0.2", "m").holds(kState));
}

TEST(Condition, NestedFieldsAreAttributes) {
  EXPECT_TRUE(Condition("m.header.stamp.sec == 3 and 'b' in m.name", "m").holds(kState));
}

TEST(Condition, FieldsOfListedMessagesAreAttributes) {
  EXPECT_TRUE(Condition("m.points[1].x < 0", "m").holds("points:\n- x: 1.0\n- x: -1.0\n"));
}

TEST(Condition, UnfinishedExpressionIsRefused) {
  EXPECT_THROW(Condition("m.position[", "m"), InputError);
}

TEST(Condition, UnknownFieldIsRefusedWithNearest) {
  const Condition condition("m.postion[0] > 0", "m");
  try {
    static_cast<void>(condition.holds(kState));
    FAIL() << "the condition was evaluated";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean 'position'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace doppel
