// The suite file: every key, and every error with its place.
#include "doppel/validation/checks/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class SuiteTest : public testing::Test {
 protected:
  Suite read(const std::string& text) {
    const fs::path file =
        fs::path(testing::TempDir()) /
        (std::string("suite_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml");
    std::ofstream(file) << text;
    return load_suite(file);
  }
  std::string errors(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(SuiteTest, ContactAndSupplyAreReadInSi) {
  const Suite suite = read(R"(
contact: {hand: {force: 140 N, stiffness: 75 N/mm, mass: 600 g}}
supply: {voltage: 5 V, current: 10 A, efficiency: 60 %}
)");
  EXPECT_DOUBLE_EQ(suite.contact.at("hand").stiffness, 75e3);
  EXPECT_DOUBLE_EQ(suite.contact.at("hand").mass, 0.6);
  ASSERT_TRUE(suite.supply);
  EXPECT_DOUBLE_EQ(suite.supply->current, 10);
  EXPECT_DOUBLE_EQ(suite.supply->efficiency, 0.6);
  EXPECT_THAT(errors("contact: {hand: {force: 140 N}}"), HasSubstr("a region needs a stiffness"));
  EXPECT_THAT(errors("supply: {voltage: 5 V}"), HasSubstr("supply needs a current"));
  EXPECT_THAT(errors("supply: {voltage: 5 A, current: 1 A}"), HasSubstr("for example 5 V"));
}

TEST_F(SuiteTest, EveryKeyIsReadInSi) {
  const Suite suite = read(R"(
workspace: {frame: base_link, box: [[-0.3, 50 mm, 0.0], [0.3, 0.35, 40 cm]], step: 5 cm, directions: 26}
tool: {link: tool0, payload: {mass: 200 g, at: [0, 0, 0.06]}}
poses: {home: {"Revolute 1": 90 deg, slide: 20 mm}}
step_response: {size: 0.4 rad, overshoot: 5 %, settling: 400 ms, "Revolute 8": {size: 0.3 rad}}
reachability: {max_missed: 2 %}
self_collision: {max_share: 30 %}
coverage: {min_seen: 80 %}
drop: {settling: 3 s, penetration: 2 mm}
datasheet: mg996r
waive: [{gate: G05, link: base_link, why: "scan of the real base", until: 2027-06-01}]
)");
  ASSERT_TRUE(suite.workspace);
  EXPECT_EQ(suite.workspace->low, Eigen::Vector3d(-0.3, 0.05, 0));
  EXPECT_DOUBLE_EQ(suite.workspace->high.z(), 0.4);
  EXPECT_DOUBLE_EQ(suite.workspace->step, 0.05);
  EXPECT_DOUBLE_EQ(suite.tool.mass, 0.2);
  EXPECT_EQ(suite.tool.p_LoC_L, Eigen::Vector3d(0, 0, 0.06));
  EXPECT_DOUBLE_EQ(suite.poses.at("home").at("Revolute 1"), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(suite.poses.at("home").at("slide"), 0.02);
  EXPECT_DOUBLE_EQ(suite.step.settling, 0.4);
  EXPECT_DOUBLE_EQ(suite.step_of("Revolute 8").size, 0.3);
  EXPECT_DOUBLE_EQ(suite.step_of("Revolute 8").settling, 0.4);  // that of all joints
  EXPECT_DOUBLE_EQ(suite.step_of("Revolute 1").size, 0.4);
  EXPECT_DOUBLE_EQ(suite.max_missed, 0.02);
  EXPECT_EQ(suite.max_share, 0.3);
  EXPECT_EQ(suite.min_seen, 0.8);
  EXPECT_DOUBLE_EQ(suite.drop.settling, 3);
  EXPECT_DOUBLE_EQ(suite.drop.penetration, 0.002);
  EXPECT_EQ(suite.datasheet, "mg996r");
  ASSERT_EQ(suite.waivers.size(), 1U);
  EXPECT_EQ(suite.waivers[0].subject, "base_link");
  EXPECT_EQ(suite.waivers[0].until, "2027-06-01");
}

TEST_F(SuiteTest, AllErrorsAreReportedAtOnceWithTheirPlaces) {
  const std::string text = errors(
      "workspac: {}\n"
      "step_response: {overshot: 5 %, settling: fast}\n"
      "drop: {settling: -1 s}\n"
      "waive:\n"
      "  - {gate: G77, why: because}\n"
      "  - {gate: G05}\n"
      "  - {gate: G05, why: scan, until: tomorrow}\n");
  EXPECT_THAT(text, HasSubstr("did you mean 'workspace'"));
  EXPECT_THAT(text, HasSubstr("did you mean 'overshoot'"));
  EXPECT_THAT(text, HasSubstr(".yaml:2:42"));
  EXPECT_THAT(text, HasSubstr("settling must be more than zero"));
  EXPECT_THAT(text, HasSubstr("there is no gate or test 'G77'"));
  EXPECT_THAT(text, HasSubstr("a waiver needs a reason"));
  EXPECT_THAT(text, HasSubstr("until must be a date"));
}

TEST_F(SuiteTest, BoxThatIsInsideOutOrTooFineIsRefused) {
  EXPECT_THAT(errors("workspace: {box: [[0, 0, 0], [1, -1, 1]]}"), HasSubstr("must be below the second one"));
  EXPECT_THAT(errors("workspace: {box: [[0, 0, 0], [1, 1, 1]], step: 1 mm}"), HasSubstr("2 million cells"));
  EXPECT_THAT(errors("workspace: {box: [[0, 0], [1, 1, 1]]}"), HasSubstr("three lengths"));
}

}  // namespace
}  // namespace doppel
