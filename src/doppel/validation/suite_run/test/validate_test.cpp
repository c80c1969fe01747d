// Whole validations: every bundled robot, the same result for any number of jobs, waivers, refusals, the end
// of the time.
#include "doppel/validation/suite_run/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "doppel/base/core/diagnostic.h"
#include "doppel/validation/reports/results.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Subject subject_of(const std::string& target) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = target}};
  SubjectOptions options;
  options.datasheets = DOPPEL_SOURCE_DIR "/datasheets";
  return read_subject(scenario, options);
}

ValidationOptions quick() {
  ValidationOptions out;
  out.effort = Effort::quick;
  out.write_answers = false;
  out.jobs = 2;
  return out;
}

std::string failures(const ValidationReport& report) {
  std::string out;
  for (const CheckResult& check : report.checks) {
    if (!is_failure(check.verdict, false)) continue;
    out += check.id + ": " + check.summary + "\n";
    for (const CheckItem& item : check.items) out += "  " + item.subject + ": " + item.message + "\n";
  }
  return out;
}

const CheckResult& result(const ValidationReport& report, const std::string& id) {
  const auto found = std::ranges::find(report.checks, id, &CheckResult::id);
  if (found == report.checks.end()) throw std::runtime_error(id + " has not run");
  return *found;
}

class BundledRobot : public testing::TestWithParam<const char*> {};

TEST_P(BundledRobot, PassesEveryGateAndTest) {
  const Subject subject = subject_of(GetParam());
  const ValidationReport report = validate(subject, {}, quick());
  EXPECT_TRUE(report.passed()) << failures(report);
  EXPECT_EQ(report.checks.size(), 21U);
  EXPECT_EQ(result(report, "G03").verdict, Verdict::passed);
  EXPECT_EQ(result(report, "G10").verdict, Verdict::passed);
}

INSTANTIATE_TEST_SUITE_P(All, BundledRobot,
                         testing::Values("omarm_one", "omarm_zero", "lab_arm", "kate", "turtle",
                                         "ackermann_car", "rover_mecanum", "rover_skid"),
                         [](const auto& robot) { return std::string(robot.param); });

// The Validate panel beside a running arm judges a copy of it.
TEST(ValidateTest, ArmWithEmulatedServosIsJudgedWithoutThem) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "desk_arm", .arguments = {{"use_sim", "false"}}}};
  scenario.hardware = HardwareUse::emulated;
  const Subject subject =
      read_subject(scenario, {.datasheets = DOPPEL_SOURCE_DIR "/datasheets", .datasheet = {}});
  ValidationOptions options = quick();
  options.only = {"G09", "G13", "T2", "T4"};
  options.joint = "elbow_flex";
  const ValidationReport report = validate(subject, {}, options);
  EXPECT_TRUE(report.passed()) << failures(report);
  EXPECT_EQ(result(report, "G13").verdict, Verdict::passed);
}

TEST(ValidateTest, ResultsAreEqualForAnyNumberOfJobs) {
  const Subject subject = subject_of("lab_arm");
  std::vector<std::string> texts;
  for (const std::size_t jobs : {1U, 4U}) {
    ValidationOptions options = quick();
    options.jobs = jobs;
    texts.push_back(to_json(validate(subject, {}, options), {.wall_clock = false}));
  }
  EXPECT_EQ(texts[0], texts[1]);
}

TEST(ValidateTest, OnlyChosenChecksRun) {
  const Subject subject = subject_of("omarm_zero");
  ValidationOptions options = quick();
  options.only = {"G06", "T4"};
  options.joint = "Revolute 2";
  const ValidationReport report = validate(subject, {}, options);
  ASSERT_EQ(report.checks.size(), 2U);
  for (const Metric& metric : result(report, "T4").metrics)
    EXPECT_THAT(metric.subject, HasSubstr("Revolute 2"));
  EXPECT_FALSE(result(report, "T4").metrics.empty());
}

// Limits that omarm_zero cannot meet.
Suite strict_suite() {
  Suite out;
  out.step.settling = 1e-3;
  return out;
}

TEST(ValidateTest, WaiverAcceptsFailureUntilItsDate) {
  const Subject subject = subject_of("omarm_zero");
  ValidationOptions options = quick();
  options.only = {"T4"};
  options.joint = "Revolute 3";
  options.today = "2026-11-28";
  Suite suite = strict_suite();
  EXPECT_FALSE(validate(subject, suite, options).passed());
  suite.waivers.push_back({"T4", "Revolute 3", "slow on purpose", "2026-12-31", {}});
  const ValidationReport waived = validate(subject, suite, options);
  EXPECT_TRUE(waived.passed()) << failures(waived);
  EXPECT_EQ(result(waived, "T4").verdict, Verdict::waived);
  EXPECT_THAT(result(waived, "T4").items.front().message, HasSubstr("slow on purpose"));
  options.today = "2027-01-01";
  const ValidationReport expired = validate(subject, suite, options);
  EXPECT_FALSE(expired.passed());
  EXPECT_THAT(expired.notes, ElementsAre(HasSubstr("ended on 2026-12-31")));
}

TEST(ValidateTest, GateOfWaivedTestHasItsVerdict) {
  const Subject subject = subject_of("omarm_zero");
  ValidationOptions options = quick();
  options.only = {"G14"};
  Suite suite;
  suite.max_share = 0;
  EXPECT_EQ(result(validate(subject, suite, options), "G14").verdict, Verdict::failed);
  suite.waivers.push_back({"T3", "", "an arm that folds", "", {}});
  std::map<std::string, Verdict> reported;
  options.on_result = [&](const CheckResult& one) { reported[one.id] = one.verdict; };
  const ValidationReport waived = validate(subject, suite, options);
  EXPECT_TRUE(waived.passed()) << failures(waived);
  EXPECT_EQ(result(waived, "G14").verdict, result(waived, "T3").verdict);
  EXPECT_EQ(reported["T3"], result(waived, "T3").verdict) << "expected a result with its waiver";
  EXPECT_EQ(reported["G14"], result(waived, "G14").verdict);
}

TEST(ValidateTest, WaiverThatIsNotNeededIsReported) {
  const Subject subject = subject_of("omarm_zero");
  ValidationOptions options = quick();
  options.only = {"G05"};
  Suite suite;
  suite.waivers.push_back({"G05", "", "why not", "", {}});
  EXPECT_THAT(validate(subject, suite, options).notes, ElementsAre(HasSubstr("is not needed")));
}

TEST(ValidateTest, DescriptionWithErrorsFailsParsingAndRunsNothingElse) {
  const fs::path file = fs::path(testing::TempDir()) / "two_roots.urdf";
  std::ofstream(file) << "<robot name='r'><link name='a'/><link name='b'/></robot>";
  const ValidationReport report = validate(subject_of(file.string()), {}, quick());
  EXPECT_EQ(result(report, "G02").verdict, Verdict::failed);
  EXPECT_EQ(result(report, "T4").verdict, Verdict::not_run);
  EXPECT_EQ(result(report, "T4").summary, "not run: G02");
  EXPECT_FALSE(report.passed());
}

TEST(ValidateTest, EndedValidationIsNotComplete) {
  const Subject subject = subject_of("omarm_zero");
  ValidationOptions options = quick();
  options.progress = [](double, const std::string& id) { return id != "T3"; };
  const ValidationReport report = validate(subject, {}, options);
  EXPECT_FALSE(report.complete);
  EXPECT_FALSE(report.passed());
}

TEST(ValidateTest, ChecksAfterEndOfTimeAreNotRun) {
  const Subject subject = subject_of("omarm_zero");
  ValidationOptions options = quick();
  options.jobs = 1;
  options.max_seconds = 1e-9;
  const ValidationReport report = validate(subject, {}, options);
  EXPECT_THAT(result(report, "T6").summary, HasSubstr("the time is over"));
  EXPECT_FALSE(report.passed());
}

TEST(ValidateTest, ProgressAscendsToOne) {
  const Subject subject = subject_of("turtle");
  ValidationOptions options = quick();
  double before = 0;
  options.progress = [&before](double done, const std::string&) {
    EXPECT_GE(done, before - 1e-12);
    before = done;
    return true;
  };
  static_cast<void>(validate(subject, {}, options));
  EXPECT_NEAR(before, 1, 1e-9);
}

TEST(CheckIds, WordsNameChecksAndGroups) {
  EXPECT_THAT(check_ids({"t4", "G13"}), ElementsAre("T4", "G13"));
  EXPECT_EQ(check_ids({"gates"}).size(), 15U);
  EXPECT_EQ(check_ids({"tests"}).size(), 6U);
  EXPECT_THAT(check_ids({}), IsEmpty());
  try {
    check_ids({"T44"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(std::string(error.what()), HasSubstr("did you mean"));
  }
}

}  // namespace
}  // namespace doppel
