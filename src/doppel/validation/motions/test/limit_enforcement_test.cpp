// T2 on an arm: all ways of a command, what a stack without limits lets through, and any number of threads.
#include "doppel/validation/motions/limit_enforcement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "doppel/validation/motions/machine_run.h"

namespace doppel {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class LimitEnforcementTest : public testing::Test {
 protected:
  LimitEnforcementTest() {
    Scenario scenario;
    scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    scenario.robots = {{.target = "omarm_zero"}};
    SubjectOptions options;
    options.datasheets = DOPPEL_SOURCE_DIR "/datasheets";
    subject_ = read_subject(scenario, options);
    context_.effort = Effort::quick;
    context_.joint = "Revolute 2";
    context_.write_answers = false;
  }

  Subject subject_;
  Suite suite_;
  CheckContext context_{subject_, suite_};
};

std::string text_of(const CheckResult& result) {
  std::string out = result.summary + "\n";
  for (const CheckItem& item : result.items) out += item.subject + ": " + item.message + "\n";
  for (const std::string& note : result.notes) out += note + "\n";
  return out;
}

TEST_F(LimitEnforcementTest, LimitsThatAreEnforcedPassOnEachWay) {
  const CheckResult result = check_limit_enforcement(context_);
  EXPECT_EQ(result.verdict, Verdict::passed) << text_of(result);
  EXPECT_THAT(result.notes,
              Contains(HasSubstr("would have let 2 of 4 commands through: beyond the upper limit 1 of 1, "
                                 "beyond the lower limit 1 of 1, NaN 0 of 1")));
}

TEST_F(LimitEnforcementTest, LimitsThatAreNotEnforcedFail) {
  subject_.scenario.enforce_limits = false;
  const CheckResult result = check_limit_enforcement(context_);
  EXPECT_EQ(result.verdict, Verdict::failed);
  EXPECT_THAT(text_of(result), HasSubstr("Revolute 2, beyond the upper limit"));
  EXPECT_THAT(text_of(result), Not(HasSubstr("/gazebo/")));
}

TEST_F(LimitEnforcementTest, ResultsAreEqualForAnyNumberOfThreads) {
  context_.joint.clear();
  const std::string one = text_of(check_limit_enforcement(context_));
  context_.threads = 3;
  EXPECT_EQ(text_of(check_limit_enforcement(context_)), one);
}

TEST_F(LimitEnforcementTest, ServiceNamesJointOfRefusedCommand) {
  MachineRun machine(context_, {});
  const int joint = machine.joints().front();
  const std::vector<JointWay> ways = machine.service_ways(joint);
  ASSERT_EQ(ways.size(), 2U);
  const double present = machine.position(joint);
  for (const JointWay& way : ways) {
    machine.send(way, std::numeric_limits<double>::quiet_NaN(), 0.1);
    machine.run(0.02);
    EXPECT_TRUE(machine.is_refused()) << way.name();
    EXPECT_THAT(machine.answer(), HasSubstr("Revolute 2")) << way.name();
  }
  machine.send(ways.front(), machine.joint(joint).upper + 0.5);
  machine.run(0.02);
  EXPECT_THAT(machine.answer(), HasSubstr("outside the limits of 'omarm_zero::Revolute 2'"));
  EXPECT_NEAR(machine.position(joint), present, 1e-3);
}

}  // namespace
}  // namespace doppel
