// X5 and X4: profiles and paths by their geometry, and figures of arms whose servos have steps and play.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/validation/extras/detail/test_paths.h"
#include "doppel/validation/extras/path_extra.h"
#include "doppel/validation/extras/pose_extras.h"

namespace doppel {
namespace {

using testing::HasSubstr;

Subject bundled_arm(const std::string& robot) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = robot}};
  return read_subject(scenario, {});
}

CheckContext quick_arm(const Subject& subject, const Suite& suite) {
  CheckContext out{subject, suite};
  out.effort = Effort::quick;
  out.write_answers = false;
  return out;
}

const Metric& metric_of(const CheckResult& result, const std::string& name, const std::string& part) {
  for (const Metric& metric : result.metrics)
    if (metric.name == name && metric.subject.find(part) != std::string::npos) return metric;
  throw std::runtime_error("no " + name + " of " + part);
}

bool has_metric(const CheckResult& result, const std::string& name) {
  return std::ranges::find(result.metrics, name, &Metric::name) != result.metrics.end();
}

TEST(PathProfile, CoversLengthWithConstantSpeedBetweenRamps) {
  const PathProfile profile{0.4, 0.1, 0.2};
  EXPECT_DOUBLE_EQ(profile.ramp_time(), 1);
  EXPECT_DOUBLE_EQ(profile.time(), 3);
  EXPECT_DOUBLE_EQ(profile.way(-1), 0);
  EXPECT_NEAR(profile.way(1), 0.1, 1e-15);
  EXPECT_NEAR(profile.way(1.5), 0.2, 1e-15);
  EXPECT_NEAR(profile.way(2), 0.3, 1e-15);
  EXPECT_NEAR(profile.way(3), 0.4, 1e-15);
  EXPECT_NEAR(profile.way(9), 0.4, 1e-15);
  constexpr double kStep = 1e-4;
  double before = 0;
  for (double time = kStep; time < 3; time += kStep) {
    const double speed = (profile.way(time) - before) / kStep;
    EXPECT_GE(speed, -1e-9);
    EXPECT_LE(speed, 0.2 + 1e-9);
    before = profile.way(time);
  }
}

TEST(TestPaths, LineCircleAndCornerHaveTheirGeometry) {
  const Subject subject = bundled_arm("omarm_one");
  const Suite suite;
  const CheckContext context = quick_arm(subject, suite);
  const std::vector<ExtraArm> arms = extra_arms(context);
  const auto plane = find_test_plane(context, arms.front());
  ASSERT_TRUE(plane);
  std::vector<std::string> why;
  const std::vector<TestPath> paths = test_paths(context, arms.front(), *plane, why);
  ASSERT_FALSE(paths.empty()) << testing::PrintToString(why);
  EXPECT_EQ(paths.size() + why.size(), 3U);
  for (const TestPath& path : paths) {
    EXPECT_GT(path.speed, 0);
    EXPECT_EQ(path.u.size(), path.way.size());
    EXPECT_LT((path.at(0.5 * path.length()) - path.u[path.u.size() / 2]).norm(), 0.05);
    if (path.name == "line") {
      EXPECT_NEAR(path.length(), 0.8 * std::sqrt(3) * plane->edge, 1e-5);
    } else if (path.name == "circle") {
      for (const Pose& X_RT : path.X_RT)
        EXPECT_NEAR((X_RT.translation() - plane->centre).norm(), 0.4 * plane->edge, 1e-5);
      const double compared = path.way[path.end - 1] - path.way[path.begin];
      EXPECT_NEAR(compared, 0.8 * std::numbers::pi * plane->edge, 0.05 * plane->edge);
    } else {
      EXPECT_NEAR(path.length(), 0.8 * (1 + std::sqrt(2)) * plane->edge, 1e-5);
      EXPECT_NEAR(path.before.dot(path.after), 0, 1e-9);
    }
  }
}

TEST(PathExtra, NumbersAreThoseOfArmAndRepeat) {
  const Subject subject = bundled_arm("omarm_one");
  const Suite suite;
  const CheckResult result = check_paths(quick_arm(subject, suite)),
                    again = check_paths(quick_arm(subject, suite));
  ASSERT_EQ(result.verdict, Verdict::passed) << result.summary;
  const double slow = metric_of(result, "path accuracy", "line, 10 %").value,
               fast = metric_of(result, "path accuracy", "line, 100 %").value;
  EXPECT_GT(slow, 0);
  EXPECT_LT(slow, 5);  // mm: the arm sags by up to 3 mm
  EXPECT_LT(fast, 20);
  EXPECT_LT(metric_of(result, "speed accuracy", "line, 10 %").value, 5);
  EXPECT_LE(metric_of(result, "cornering round-off", "10 %").value,
            metric_of(result, "cornering round-off", "100 %").value + 0.1);
  ASSERT_EQ(result.items.size(), again.items.size());
  for (std::size_t i = 0; i < result.items.size(); ++i)
    EXPECT_EQ(result.items[i].message, again.items[i].message);
}

TEST(PoseExtras, StepsOfServosMakePosesVary) {
  Subject subject = bundled_arm("omarm_one");
  const Suite suite;
  const double before =
      metric_of(check_pose_accuracy(quick_arm(subject, suite)), "pose repeatability", "P1").value;
  for (const std::string& joint : subject.model->driven_joint_names())
    subject.precision[joint] = {"STS3215", 2 * std::numbers::pi / 4096, 0, 0};
  const CheckResult result = check_pose_accuracy(quick_arm(subject, suite));
  const double after = metric_of(result, "pose repeatability", "P1").value;
  EXPECT_LT(before, 0.05);
  EXPECT_GT(after, 0.1);  // mm: half a step at 0.3 m is 0.23 mm
  EXPECT_LT(after, 3);
  EXPECT_THAT(result.notes.back(), HasSubstr("STS3215 (resolution 0.0879 deg)"));
}

TEST(PoseExtras, PlayMakesPosesVaryByDirectionOfApproach) {
  Subject subject = bundled_arm("omarm_one");
  const Suite suite;
  const auto largest = [&] {
    const CheckResult result = check_pose_approach(quick_arm(subject, suite));
    double out = -1;
    for (const Metric& metric : result.metrics)
      if (metric.name == "variation by direction") out = std::max(out, metric.value);
    return out;
  };
  const double before = largest();
  ASSERT_GE(before, 0);
  for (const std::string& joint : subject.model->driven_joint_names())
    subject.precision[joint] = {"X", 0, 0.01, 0};
  const double after = largest();
  EXPECT_GT(after, before + 0.5);  // mm: a play of 0.01 rad at 0.2 m is 2 mm
}

TEST(PoseExtras, NothingVariesWithoutFrictionAndSheet) {
  Subject subject = bundled_arm("omarm_one");
  const Suite suite;
  EXPECT_FALSE(has_metric(check_pose_accuracy(quick_arm(subject, suite)), "drift of accuracy"));
}

TEST(PoseExtras, CyclesAreSharedBetweenChecks) {
  const Subject subject = bundled_arm("omarm_one");
  const Suite suite;
  SharedResults shared;
  CheckContext context = quick_arm(subject, suite);
  int reports = 0;
  context.progress = [&](double) {
    ++reports;
    return true;
  };
  const CheckResult alone = check_power(context);
  const int of_one = reports;
  reports = 0;
  context.shared = &shared;
  check_pose_accuracy(context);
  const CheckResult after = check_power(context);
  EXPECT_EQ(reports, of_one);
  ASSERT_FALSE(after.items.empty());
  EXPECT_EQ(after.items.front().message, alone.items.front().message);
}

}  // namespace
}  // namespace doppel
