#include "doppel/session/live/health_publisher.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/session/live/audit_result.h"

namespace doppel {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class HealthPublisherTest : public ::testing::Test {
 protected:
  HealthPublisherTest() : listener_(bus_, "/listener") {
    listener_.subscribe<std_msgs::msg::String>(
        "/doppel/health", [this](const std_msgs::msg::String& message) { health_ = message.data; });
  }
  // Runs the bus until that is the health.
  bool becomes(const std::string& health) {
    for (const auto end = std::chrono::steady_clock::now() + seconds(20);
         health_ != health && std::chrono::steady_clock::now() < end;) {
      bus_.wait(milliseconds(100));
      bus_.spin();
    }
    return health_ == health;
  }

  Bus bus_;
  Node listener_;
  RobotDescription robot_;
  std::string health_;
};

TEST_F(HealthPublisherTest, LastOfManyRequestsIsAudited) {
  std::atomic<int> wanted{0};
  HealthPublisher publisher(bus_, "", [&] { return std::to_string(wanted); });
  for (int i = 1; i <= 50; ++i) {
    wanted = i;
    publisher.look_at(robot_);
    bus_.spin();
  }
  EXPECT_TRUE(becomes("50")) << health_;
}

TEST_F(HealthPublisherTest, RetiredPublisherEndsWithoutBeingWaitedFor) {
  std::atomic<bool> is_auditing{false}, may_end{false};
  HealthPublisher publisher(bus_, "", [&] {
    is_auditing = true;
    while (!may_end) std::this_thread::yield();
    return std::string("late");
  });
  publisher.look_at(robot_);
  while (!is_auditing) std::this_thread::yield();
  publisher.retire();
  EXPECT_FALSE(publisher.has_ended()) << "expected the audit to go on";
  may_end = true;
  while (!publisher.has_ended()) std::this_thread::yield();
  bus_.spin();
  EXPECT_EQ(health_, "") << "expected no report of a retired publisher";
}

TEST_F(HealthPublisherTest, AuditOutlastingPublisherIsAbandoned) {
  std::atomic<bool> is_auditing{false}, may_end{false}, has_ended{false};
  {
    HealthPublisher publisher(bus_, "", [&] {
      is_auditing = true;
      while (!may_end) std::this_thread::yield();
      has_ended = true;
      return std::string("late");
    });
    publisher.look_at(robot_);
    while (!is_auditing) std::this_thread::yield();
  }
  EXPECT_TRUE(has_abandoned_thread());
  may_end = true;
  while (!has_ended) std::this_thread::yield();
  bus_.wait(milliseconds(200));
  bus_.spin();
  EXPECT_EQ(health_, "");
}

TEST_F(HealthPublisherTest, ReportIsAnnouncedOnLoopThreadAfterPublication) {
  int announced = 0;
  const auto loop = std::this_thread::get_id();
  HealthPublisher publisher(
      bus_, "", [] { return std::string("report"); },
      [&] {
        EXPECT_EQ(std::this_thread::get_id(), loop);
        ++announced;
      });
  publisher.look_at(robot_);
  EXPECT_TRUE(becomes("report")) << health_;
  EXPECT_EQ(announced, 1);
}

AuditReport report_with(const std::vector<Severity>& severities) {
  AuditReport out;
  for (const Severity severity : severities) {
    Finding& finding = out.findings.emplace_back();
    finding.rule = "mesh.unit";
    finding.severity = severity;
    finding.subject = "link 'b'";
    finding.message = "its mesh is 300 m large";
  }
  return out;
}

TEST(ErrorSummary, ErrorsAreOneLineWithCommandThatListsThem) {
  EXPECT_EQ(error_summary(report_with({Severity::error, Severity::warning}), "b.urdf"),
            "1 error: link 'b': its mesh is 300 m large [mesh.unit]; 'doppel check b.urdf' prints its "
            "consequence and "
            "fix");
  EXPECT_EQ(
      error_summary(report_with({Severity::error, Severity::error}), "b.urdf"),
      "2 errors, for example link 'b': its mesh is 300 m large [mesh.unit]; 'doppel check b.urdf' lists all");
  EXPECT_EQ(error_summary(report_with({Severity::warning, Severity::note}), "b.urdf"), "");
}

TEST(ErrorSummary, UnchangedLineIsTakenOnce) {
  ErrorSummary summary;
  EXPECT_EQ(summary.take(), std::nullopt) << "a start without errors prints nothing";
  summary.set("1 error");
  EXPECT_EQ(summary.take(), "1 error");
  summary.set("1 error");
  EXPECT_EQ(summary.take(), std::nullopt);
  summary.set("");
  EXPECT_EQ(summary.take(), "");
}

}  // namespace
}  // namespace doppel
