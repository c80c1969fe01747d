#include "doppel/base/core/near_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace doppel {
namespace {

const std::vector<std::string> kTopics{"/clock",  "/joint_states", "/rosout", "/tf",  "/tf_static",
                                       "/camera", "/scan",         "/odom",   "/imu", "/cmd_vel"};

TEST(NamesNear, MisspelledNameGetsNearest) {
  EXPECT_EQ(names_near("/joint_sates", kTopics), "; did you mean '/joint_states'?");
}

TEST(NamesNear, NameFarFromAllGetsThreeNearest) {
  const std::string text = names_near("/nothing", kTopics);
  EXPECT_TRUE(text.starts_with("; the nearest are '/")) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), ','), 2) << text;
}

TEST(NamesNear, NoCandidatesGiveNoText) {
  EXPECT_EQ(names_near("/nothing", {}), "");
}

}  // namespace
}  // namespace doppel
