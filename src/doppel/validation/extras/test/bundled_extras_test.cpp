// Every bundled robot runs every extra without a failure.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "doppel/validation/extras/contact_extra.h"
#include "doppel/validation/extras/kinematics_extra.h"
#include "doppel/validation/extras/path_extra.h"
#include "doppel/validation/extras/payload_extra.h"
#include "doppel/validation/extras/pose_extras.h"
#include "doppel/validation/extras/response_extra.h"
#include "doppel/validation/extras/sag_extra.h"
#include "doppel/validation/extras/singularity_extra.h"
#include "doppel/validation/extras/stopping_extra.h"

namespace doppel {
namespace {

using ExtraFunction = CheckResult (*)(const CheckContext&);
const std::map<std::string, ExtraFunction>& extra_functions() {
  static const std::map<std::string, ExtraFunction> all = {
      {"X1", check_kinematics},    {"X2", check_frequency_response},
      {"X3", check_pose_accuracy}, {"X4", check_pose_approach},
      {"X5", check_paths},         {"X6", check_payload},
      {"X7", check_sag},           {"X8", check_power},
      {"X9", check_stopping},      {"X10", check_contact},
      {"X11", check_singularities}};
  return all;
}

Subject bundled(const std::string& robot) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = robot}};
  return read_subject(scenario, {});
}

CheckContext quick_context(const Subject& subject, const Suite& suite) {
  CheckContext out{subject, suite};
  out.effort = Effort::quick;
  out.write_answers = false;
  return out;
}

class BundledExtras : public testing::TestWithParam<const char*> {};

TEST_P(BundledExtras, GiveNumbersOrReason) {
  const Subject subject = bundled(GetParam());
  ASSERT_TRUE(subject.refusal.empty());
  const Suite suite;
  SharedResults shared;
  for (const auto& [id, function] : extra_functions()) {
    CheckContext context = quick_context(subject, suite);
    context.shared = &shared;
    const CheckResult result = function(context);
    EXPECT_EQ(result.id, id);
    EXPECT_FALSE(result.summary.empty()) << id;
    EXPECT_TRUE(result.verdict == Verdict::passed || result.verdict == Verdict::not_applicable)
        << id << ": " << result.summary;
    if (result.verdict == Verdict::passed) {
      EXPECT_FALSE(result.metrics.empty()) << id;
      EXPECT_FALSE(result.items.empty()) << id;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, BundledExtras,
                         testing::Values("omarm_one", "omarm_zero", "lab_arm", "kate", "turtle",
                                         "ackermann_car", "rover_mecanum", "rover_skid"),
                         [](const auto& robot) { return std::string(robot.param); });

TEST(PoseExtras, NumbersRepeat) {
  const Subject subject = bundled("omarm_one");
  const Suite suite;
  std::vector<std::string> texts;
  for (int i = 0; i < 2; ++i) {
    const CheckResult result = check_pose_accuracy(quick_context(subject, suite));
    ASSERT_FALSE(result.items.empty()) << result.summary;
    texts.push_back(result.items.front().message);
    for (const Metric& metric : result.metrics) {
      if (metric.name != "pose accuracy") continue;
      EXPECT_GT(metric.value, 0);
      EXPECT_LT(metric.value, 5);  // mm: the arm sags by up to 3 mm, and touches nothing
    }
  }
  EXPECT_EQ(texts[0], texts[1]);
}

TEST(PoseExtras, WeakSupplyIsWarnedOf) {
  const Subject subject = bundled("omarm_one");
  Suite suite;
  suite.supply = PowerSupply{5, 0.01, 0.6};
  EXPECT_EQ(check_power(quick_context(subject, suite)).verdict, Verdict::warned);
  suite.supply->current = 100;
  EXPECT_EQ(check_power(quick_context(subject, suite)).verdict, Verdict::passed);
}

}  // namespace
}  // namespace doppel
