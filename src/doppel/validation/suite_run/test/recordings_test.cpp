// Recordings of motions that fail: what is in them shows what the report says, and those who pass have none.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "broken_robot_files.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/validation/suite_run/validate.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;

constexpr double kNanoseconds = 1e-9;  // s

ValidationReport run(const Subject& subject, const Suite& suite, const std::string& check,
                     const std::string& joint = "", std::size_t jobs = 1) {
  ValidationOptions options;
  options.effort = Effort::quick;
  options.write_answers = false;
  options.only = {check};
  options.joint = joint;
  options.record = true;
  options.jobs = jobs;
  return validate(subject, suite, options);
}

std::string bytes_of(const FailureRecording& recording) {
  return {reinterpret_cast<const char*>(recording.bytes->data()), recording.bytes->size()};
}

// A recording as a file, read by the reader of bags.
class ReadRecording {
 public:
  explicit ReadRecording(const FailureRecording& recording)
      : file_(fs::path(testing::TempDir()) / fmt::format("{}-{}", getpid(), recording.file)) {
    std::ofstream(file_, std::ios::binary) << bytes_of(recording);
    BagReader bag(file_.string());
    notes = bag.contents().notes;
    start = static_cast<double>(bag.contents().start) * kNanoseconds;
    end = static_cast<double>(bag.contents().end) * kNanoseconds;
    for (const BagPart& part : bag.contents().attachments) attachments.insert(part.part.name);
    double before = 0;
    while (const auto message = bag.next()) {
      const BagTopic& topic = bag.contents().topics[message->topic];
      ++messages[topic.name];
      const double time = static_cast<double>(message->log_time) * kNanoseconds;
      EXPECT_GE(time, before);
      before = time;
      read(topic, *message);
    }
  }
  ~ReadRecording() { fs::remove(file_); }
  ReadRecording(const ReadRecording&) = delete;
  ReadRecording& operator=(const ReadRecording&) = delete;

  [[nodiscard]] std::set<std::string> topics() const {
    std::set<std::string> out;
    for (const auto& [topic, count] : messages) out.insert(topic);
    return out;
  }

  std::vector<std::string> notes;
  std::set<std::string> attachments, links;
  std::map<std::string, int> messages;
  std::string description;
  double start = 0, end = 0;
  std::map<std::string, std::vector<double>> positions;  // by joint, with times
  std::vector<double> times;
  std::vector<std::pair<double, trajectory_msgs::msg::JointTrajectory>> commands;

 private:
  void read(const BagTopic& topic, const BagMessage& message) {
    const double time = static_cast<double>(message.publish_time) * kNanoseconds;
    if (topic.name == "/joint_states") {
      sensor_msgs::msg::JointState state;
      ASSERT_TRUE(from_cdr(message.data, state));
      times.push_back(time);
      for (std::size_t i = 0; i < state.name.size(); ++i)
        positions[state.name[i]].push_back(state.position[i]);
    } else if (topic.name == "/robot_description") {
      std_msgs::msg::String text;
      ASSERT_TRUE(from_cdr(message.data, text));
      description = text.data;
    } else if (topic.name == "/tf") {
      tf2_msgs::msg::TFMessage tf;
      ASSERT_TRUE(from_cdr(message.data, tf));
      for (const auto& transform : tf.transforms) links.insert(transform.child_frame_id);
    } else if (topic.type == trajectory_msgs::msg::JointTrajectory::kType) {
      ASSERT_TRUE(from_cdr(message.data,
                           commands.emplace_back(time, trajectory_msgs::msg::JointTrajectory{}).second));
    }
  }

  fs::path file_;
};

const CheckItem& recorded_item(const CheckResult& check, const std::string& file) {
  const auto found = std::ranges::find(check.items, file, &CheckItem::recording);
  if (found == check.items.end()) throw std::runtime_error("no item names " + file);
  return *found;
}

double metric_of(const CheckResult& check, const std::string& name, const std::string& subject) {
  for (const Metric& metric : check.metrics)
    if (metric.name == name && metric.subject == subject) return metric.value;
  throw std::runtime_error("no metric " + name + " of " + subject);
}

// By the definition of T4, from the last command on.
double overshoot_percent(const ReadRecording& bag, const std::string& joint) {
  const auto& [begin, command] = bag.commands.back();
  const auto index =
      static_cast<std::size_t>(std::ranges::find(command.joint_names, joint) - command.joint_names.begin());
  const std::vector<double>& positions = bag.positions.at(joint);
  double start = 0, end = 0, count = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (bag.times[i] <= begin) start = positions[i];
    if (bag.times[i] < bag.end - 0.2) continue;
    end += positions[i];
    ++count;
  }
  end /= count;
  const double height = command.points.front().positions.at(index) - start, sign = height > 0 ? 1 : -1;
  double peak = start;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (bag.times[i] > begin) peak = sign * std::max(sign * peak, sign * positions[i]);
  const double over_target = sign * (peak - command.points.front().positions.at(index)),
               over_end = sign * (peak - end);
  return 100 * std::max(0.0, std::min(over_target, over_end)) / std::abs(height);
}

TEST(Recordings, BagOfFailedStepShowsOvershootThatReportClaims) {
  const BrokenRobotFiles robot("undamped_gains");
  const Subject subject = robot.subject();
  const ValidationReport report = run(subject, robot.suite(), "T4", "joint_2");
  const CheckResult& check = report.checks.front();
  ASSERT_EQ(check.verdict, Verdict::failed);
  ASSERT_EQ(check.recordings.size(), 1U);
  EXPECT_EQ(check.recordings.front().file, "T4_joint_2.mcap");
  EXPECT_LT(check.recordings.front().bytes->size(), 20'000'000U);
  const ReadRecording bag(check.recordings.front());
  EXPECT_THAT(bag.notes, IsEmpty());
  EXPECT_THAT(bag.topics(),
              IsSupersetOf({"/robot_description", "/tf", "/tf_static", "/joint_states", "/clock",
                            "/arm_controller/joint_trajectory", "/arm_controller/controller_state"}));
  EXPECT_THAT(bag.description, HasSubstr("<robot"));
  EXPECT_THAT(bag.links, IsSupersetOf({"link_1", "link_6"}));
  ASSERT_FALSE(bag.commands.empty());
  const CheckItem& item = recorded_item(check, "T4_joint_2.mcap");
  EXPECT_EQ(item.verdict, Verdict::failed);
  const double claimed = metric_of(check, "overshoot", item.subject);
  EXPECT_GT(claimed, 10);
  EXPECT_NEAR(overshoot_percent(bag, "joint_2"), claimed, 1);
}

TEST(Recordings, SameSeedGivesSameBytesForAnyNumberOfJobs) {
  const BrokenRobotFiles robot("undamped_gains");
  const Subject subject = robot.subject();
  const ValidationReport first = run(subject, robot.suite(), "T4", "joint_3", 1),
                         second = run(subject, robot.suite(), "T4", "joint_3", 4);
  ASSERT_FALSE(first.checks.front().recordings.empty());
  ASSERT_EQ(first.checks.front().recordings.size(), second.checks.front().recordings.size());
  EXPECT_TRUE(bytes_of(first.checks.front().recordings.front()) ==
              bytes_of(second.checks.front().recordings.front()));
}

TEST(Recordings, PassingRobotHasNone) {
  const BrokenRobotFiles robot("healthy");
  const Subject subject = robot.subject();
  for (const char* const check : {"T4", "T6", "G11"}) {
    const ValidationReport report = run(subject, robot.suite(), check);
    EXPECT_EQ(report.checks.front().verdict, Verdict::passed) << check;
    EXPECT_THAT(report.checks.front().recordings, IsEmpty()) << check;
  }
}

TEST(Recordings, FailureHasNoneWithoutReport) {
  const BrokenRobotFiles robot("undamped_gains");
  ValidationOptions options;
  options.effort = Effort::quick;
  options.write_answers = false;
  options.only = {"T4"};
  options.joint = "joint_2";
  const CheckResult check = validate(robot.subject(), robot.suite(), options).checks.front();
  EXPECT_EQ(check.verdict, Verdict::failed);
  EXPECT_THAT(check.recordings, IsEmpty());
  for (const CheckItem& item : check.items) EXPECT_EQ(item.recording, "");
}

TEST(Recordings, BagOfFallMovesBaseAndJoints) {
  const BrokenRobotFiles robot("joints_without_friction");
  const Subject subject = robot.subject();
  const ValidationReport report = run(subject, robot.suite(), "T6");
  const CheckResult& check = report.checks.front();
  ASSERT_EQ(check.verdict, Verdict::failed);
  ASSERT_FALSE(check.recordings.empty());
  const ReadRecording bag(check.recordings.front());
  EXPECT_THAT(bag.topics(),
              IsSupersetOf({"/robot_description", "/tf", "/joint_states", "/mechanical_energy"}));
  EXPECT_NEAR(bag.end - bag.start, 3, 0.05);
  const std::vector<double>& moved = bag.positions.at("joint_2");
  EXPECT_GT(*std::ranges::max_element(moved) - *std::ranges::min_element(moved), 0.01);
}

TEST(Recordings, BagOfLimitTrialEndsBeyondLimit) {
  const BrokenRobotFiles robot("limits_not_enforced");
  const Subject subject = robot.subject(false);
  const ValidationReport report = run(subject, robot.suite(), "T2", "joint_3");
  const CheckResult& check = report.checks.front();
  ASSERT_EQ(check.verdict, Verdict::failed);
  ASSERT_EQ(check.recordings.size(), 1U);
  EXPECT_EQ(check.recordings.front().file, "T2_joint_3.mcap");
  const ReadRecording bag(check.recordings.front());
  const ModelJoint& joint =
      subject.model->joints[static_cast<std::size_t>(subject.model->find_joint("joint_3"))];
  const auto [least, most] = std::ranges::minmax(bag.positions.at("joint_3"));
  EXPECT_TRUE(most > joint.upper + 1e-3 || least < joint.lower - 1e-3) << least << " to " << most;
}

TEST(Recordings, BagOfHoldingSagsAsReportClaims) {
  const BrokenRobotFiles robot("weak_shoulder");
  const Subject subject = robot.subject();
  const ValidationReport report = run(subject, robot.suite(), "G11");
  const CheckResult& check = report.checks.front();
  ASSERT_EQ(check.verdict, Verdict::failed);
  ASSERT_FALSE(check.recordings.empty());
  EXPECT_EQ(check.recordings.front().file, "G11_step_0.5_ms.mcap");
  const ReadRecording bag(check.recordings.front());
  EXPECT_NEAR(bag.end - bag.start, 10, 0.1);
  const std::vector<double>& held = bag.positions.at("joint_2");
  EXPECT_GT(std::abs(held.back() - held.front()), 0.05);
}

}  // namespace
}  // namespace doppel
