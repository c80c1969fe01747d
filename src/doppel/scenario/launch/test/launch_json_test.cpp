// Lines of the reader, which the code of a launch file can write.
#include "doppel/scenario/launch/detail/launch_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace doppel {
namespace {

std::string error_of(const std::string& line) {
  try {
    static_cast<void>(bounded_json(line));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(LaunchJson, LineWithinBoundsIsItsValue) {
  EXPECT_EQ(bounded_json(R"({"a": [1, {"b": null}]})")["a"][0], 1);
  EXPECT_TRUE(bounded_json("garbage").is_discarded());
  EXPECT_TRUE(bounded_json("").is_discarded());
}

TEST(LaunchJson, LevelsAndValuesBeyondTheirBoundsAreRefused) {
  const std::string deep(2'000'000, '[');
  EXPECT_THAT(error_of(deep), testing::HasSubstr("at most 1000000 values and 1000 levels"));
  std::string many = "[";
  for (int i = 0; i < 1'000'001; ++i) many += "1,";
  EXPECT_THAT(error_of(many + "1]"), testing::HasSubstr("at most 1000000 values and 1000 levels"));
}

}  // namespace
}  // namespace doppel
