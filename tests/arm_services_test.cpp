// The services of a twin's arms: compute_ik, compute_fk and check_state_validity as move_group has them, and
// doppel's own. Behaviours are those of planning.md; their sources are files of moveit2, branch jazzy
// (4d84106).
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <thread>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/moveit_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace msrv = moveit_msgs::srv;
namespace dsrv = doppel_msgs::srv;
using moveit_msgs::msg::AttachedCollisionObject;
using moveit_msgs::msg::CollisionObject;
using moveit_msgs::msg::ContactInformation;
using moveit_msgs::msg::MoveItErrorCodes;

class ArmServicesTest : public TwinFixture {
 protected:
  // Runs the loop until the service has answered from its thread.
  template <class S>
  typename S::Response ask(const std::string& service, const typename S::Request& request) {
    std::optional<typename S::Response> answer;
    std::string problem;
    edge_->call(service, to_cdr(request), [&](const Status& status, const Bytes& response) {
      problem = status.why();
      if (!status.ok()) return;
      EXPECT_TRUE(from_cdr(response, answer.emplace()).ok());
    });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!answer && problem.empty() && std::chrono::steady_clock::now() < end) {
      twin_->between_steps();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(answer) << service << ": " << problem;
    return answer.value_or(typename S::Response{});
  }

  // The pose of a link of omarm_one's arm with these positions of its joints.
  geometry_msgs::msg::Pose pose_of(const std::string& link, const std::vector<double>& positions,
                                   const std::string& frame = "") {
    msrv::GetPositionFK::Request request;
    request.header.frame_id = frame;
    request.fk_link_names = {link};
    request.robot_state = state(positions);
    const auto response = ask<msrv::GetPositionFK>("/compute_fk", request);
    EXPECT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
    return response.pose_stamped.empty() ? geometry_msgs::msg::Pose{} : response.pose_stamped.front().pose;
  }

  static moveit_msgs::msg::RobotState state(const std::vector<double>& positions) {
    moveit_msgs::msg::RobotState out;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      out.joint_state.name.push_back("Revolute " + std::to_string(i + 1));
      out.joint_state.position.push_back(positions[i]);
    }
    return out;
  }

  static msrv::GetPositionIK::Request ik(const geometry_msgs::msg::Pose& pose) {
    msrv::GetPositionIK::Request out;
    out.ik_request.group_name = "arm";
    out.ik_request.avoid_collisions = true;
    out.ik_request.pose_stamped.pose = pose;
    return out;
  }

  static double position(const moveit_msgs::msg::RobotState& solution, const std::string& joint) {
    for (std::size_t i = 0; i < solution.joint_state.name.size(); ++i) {
      if (solution.joint_state.name[i] == joint) return solution.joint_state.position[i];
    }
    return std::nan("");
  }

  template <class M>
  void send(const std::string& topic, const M& message) {
    const Status sent = edge_->publish("/test", topic, M::kType, to_cdr(message));
    ASSERT_TRUE(sent.ok()) << sent.why();
  }

  // A box of 12 cm in the frame.
  static CollisionObject box(const std::string& id, const geometry_msgs::msg::Pose& pose,
                             const std::string& frame = "world") {
    CollisionObject out;
    out.header.frame_id = frame;
    out.id = id;
    out.pose = pose;
    out.primitives.resize(1);
    out.primitives[0].type = shape_msgs::msg::SolidPrimitive::BOX;
    out.primitives[0].dimensions = {0.12, 0.12, 0.12};
    return out;
  }

  // The names that the state with these positions touches.
  std::set<std::string> touched(const std::vector<double>& positions) {
    msrv::GetStateValidity::Request request;
    request.robot_state = state(positions);
    std::set<std::string> out;
    for (const ContactInformation& contact :
         ask<msrv::GetStateValidity>("/check_state_validity", request).contacts) {
      if (contact.body_type_1 != ContactInformation::ROBOT_LINK) out.insert(contact.contact_body_1);
      if (contact.body_type_2 != ContactInformation::ROBOT_LINK) out.insert(contact.contact_body_2);
    }
    return out;
  }

  const std::vector<double> kPose = {1.2, 1.0, 0.9, 1.3, 1.1, 0.7};
};

double distance(const geometry_msgs::msg::Pose& a, const geometry_msgs::msg::Pose& b) {
  return std::hypot(a.position.x - b.position.x, a.position.y - b.position.y, a.position.z - b.position.z);
}

// B20 (kinematics_service_capability.cpp:79-155, 171-200): with avoid_collisions; an empty link is the
// group's tip. B22: the FK of the answer is the pose.
TEST_F(ArmServicesTest, ComputeIkBringsTipToPose) {
  bring_up("omarm_one");
  const auto pose = pose_of("tool_link_1", kPose);
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", ik(pose));
  ASSERT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
  std::vector<double> found;
  for (int i = 1; i <= 6; ++i) found.push_back(position(response.solution, "Revolute " + std::to_string(i)));
  EXPECT_LT(distance(pose_of("tool_link_1", found), pose), 1e-6);
}

// B20: another link than the tip, here one behind it.
TEST_F(ArmServicesTest, ComputeIkForAnotherLinkOfArm) {
  bring_up("omarm_one");
  auto request = ik(pose_of("gripper_base_1", kPose));
  request.ik_request.ik_link_name = "gripper_base_1";
  request.ik_request.robot_state = state(kPose);
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  ASSERT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
  EXPECT_NEAR(position(response.solution, "Revolute 3"), kPose[2], 1e-5);
}

// B22 (test_kinematics_plugin.cpp:342, 710): robot_state is the seed, and the nearest solution comes back.
TEST_F(ArmServicesTest, ComputeIkReturnsSolutionNearestToState) {
  bring_up("omarm_one");
  auto request = ik(pose_of("tool_link_1", kPose));
  request.ik_request.robot_state = state(kPose);
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  for (std::size_t i = 0; i < kPose.size(); ++i)
    EXPECT_NEAR(position(response.solution, "Revolute " + std::to_string(i + 1)), kPose[i], 1e-5);
}

// B8, B20: unknown groups, links and frames are refused by their codes, with the nearest name.
TEST_F(ArmServicesTest, ComputeIkNamesWhatThereIsNot) {
  bring_up("omarm_one");
  auto request = ik(pose_of("tool_link_1", kPose));
  request.ik_request.group_name = "arn";
  auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::INVALID_GROUP_NAME);
  EXPECT_NE(response.error_code.message.find("did you mean 'arm'"), std::string::npos)
      << response.error_code.message;
  request.ik_request.group_name = "arm";
  request.ik_request.ik_link_name = "tool_link_2";
  response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::INVALID_LINK_NAME);
  EXPECT_NE(response.error_code.message.find("tool_link_1"), std::string::npos)
      << response.error_code.message;
  request.ik_request.ik_link_name = "";
  request.ik_request.pose_stamped.header.frame_id = "base_lnk";
  response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::FRAME_TRANSFORM_FAILURE);
  request.ik_request.pose_stamped.header.frame_id = "";
  request.ik_request.robot_state.joint_state.name = {"Revolut 1"};
  request.ik_request.robot_state.joint_state.position = {0};
  response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::INVALID_ROBOT_STATE);
  EXPECT_EQ(response.error_code.source, "doppel");
}

// B7: no failure without a reason.
TEST_F(ArmServicesTest, ComputeIkOutOfReachSaysByHowMuch) {
  bring_up("omarm_one");
  auto request = ik(pose_of("tool_link_1", kPose));
  request.ik_request.pose_stamped.pose.position.x = 3;
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::NO_IK_SOLUTION);
  EXPECT_NE(response.error_code.message.find("out of reach by"), std::string::npos)
      << response.error_code.message;
}

// B20: constraints decide between solutions.
TEST_F(ArmServicesTest, ComputeIkKeepsJointConstraints) {
  bring_up("omarm_one");
  auto request = ik(pose_of("tool_link_1", kPose));
  moveit_msgs::msg::JointConstraint elbow;
  elbow.joint_name = "Revolute 3";
  elbow.position = kPose[2];
  elbow.tolerance_above = elbow.tolerance_below = 0.01;
  request.ik_request.constraints.joint_constraints = {elbow};
  auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
  request.ik_request.constraints.joint_constraints[0].position = kPose[2] + 0.5;
  response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::NO_IK_SOLUTION);
}

// B21, not copied (kinematics_service_capability.cpp:109): nanoseconds of the timeout count.
TEST_F(ArmServicesTest, TimeoutBelowSecondIsNotZero) {
  bring_up("omarm_one");
  auto request = ik(pose_of("tool_link_1", kPose));
  request.ik_request.timeout.nanosec = 5'000'000;
  EXPECT_EQ(ask<msrv::GetPositionIK>("/compute_ik", request).error_code.val, MoveItErrorCodes::SUCCESS);
}

// B20: two tips of one robot, each by its own group.
TEST_F(ArmServicesTest, SeveralTipsNeedAsManyPoses) {
  bring_up("omarm_one");
  auto request = ik({});
  request.ik_request.ik_link_names = {"tool_link_1"};
  auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::INVALID_GOAL_CONSTRAINTS);
  geometry_msgs::msg::PoseStamped pose;
  pose.pose = pose_of("tool_link_1", kPose);
  request.ik_request.pose_stamped_vector = {pose};
  response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
}

// B26 (kinematics_service_capability.cpp:205-212): several links, in the header's frame.
TEST_F(ArmServicesTest, ComputeFkIsInFrameOfHeader) {
  bring_up("omarm_one");
  msrv::GetPositionFK::Request request;
  request.fk_link_names = {"tool_link_1", "link_2_1"};
  request.header.frame_id = "tool_link_1";
  request.robot_state = state(kPose);
  auto response = ask<msrv::GetPositionFK>("/compute_fk", request);
  ASSERT_EQ(response.pose_stamped.size(), 2U);
  EXPECT_LT(distance(response.pose_stamped[0].pose, {}), 1e-12);
  EXPECT_EQ(response.fk_link_names, request.fk_link_names);
  EXPECT_EQ(response.pose_stamped[0].header.frame_id, "tool_link_1");
  request.fk_link_names.clear();
  EXPECT_EQ(ask<msrv::GetPositionFK>("/compute_fk", request).error_code.val,
            MoveItErrorCodes::INVALID_LINK_NAME);
  request.fk_link_names = {"tool_link"};
  response = ask<msrv::GetPositionFK>("/compute_fk", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::INVALID_LINK_NAME);
  EXPECT_NE(response.error_code.message.find("tool_link_1"), std::string::npos);
}

// B44 (state_validation_service_capability.cpp:58-126; test_check_state_validity_in_empty_scene.py).
TEST_F(ArmServicesTest, StateThatTouchesItselfIsNotValidAndNamesLinks) {
  bring_up("omarm_one");
  msrv::GetStateValidity::Request request;
  request.group_name = "arm";
  request.robot_state = state({1.5, 1.2, 0.5, 1.5, 1.5, 1.5});
  EXPECT_TRUE(ask<msrv::GetStateValidity>("/check_state_validity", request).valid);
  request.robot_state = state({1.5, 3.1, 3.1, 1.5, 1.5, 1.5});  // folded onto itself and through the base
  const auto response = ask<msrv::GetStateValidity>("/check_state_validity", request);
  EXPECT_FALSE(response.valid);
  ASSERT_FALSE(response.contacts.empty());
  for (const ContactInformation& contact : response.contacts) {
    EXPECT_FALSE(contact.contact_body_1.empty());
    EXPECT_FALSE(contact.contact_body_2.empty());
    EXPECT_GE(contact.depth, 0);
    EXPECT_NEAR(std::hypot(contact.normal.x, contact.normal.y, contact.normal.z), 1, 1e-6);
  }
}

// The answer has no place for a reason, which is in the log.
TEST_F(ArmServicesTest, StateValidityOfUnknownJointIsExplainedInLog) {
  std::vector<std::string> lines;
  log_.add_sink([&lines](const LogLine& line) { lines.push_back(line.text); });
  bring_up("omarm_one");
  msrv::GetStateValidity::Request request;
  request.robot_state.joint_state.name = {"Revolut 1"};
  request.robot_state.joint_state.position = {0};
  EXPECT_FALSE(ask<msrv::GetStateValidity>("/check_state_validity", request).valid);
  twin_->between_steps();
  EXPECT_THAT(lines,
              testing::Contains(testing::HasSubstr("no joint 'Revolut 1'; did you mean 'Revolute 1'")));
}

// B41, B44: the twin's world is in the scene under the objects' names, as it is now.
TEST_F(ArmServicesTest, ObjectOfWorldCollidesWithArm) {
  bring_up("omarm_one");
  const auto pose = pose_of("tool_link_1", kPose, "world");
  auto request = ik(pose_of("tool_link_1", kPose));
  request.ik_request.robot_state = state(kPose);
  EXPECT_EQ(ask<msrv::GetPositionIK>("/compute_ik", request).error_code.val, MoveItErrorCodes::SUCCESS);
  spawn_ball("melon", {pose.position.x, pose.position.y, pose.position.z}, 0.06);
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::GOAL_IN_COLLISION);
  EXPECT_NE(response.error_code.message.find("melon"), std::string::npos) << response.error_code.message;
  request.ik_request.avoid_collisions = false;
  EXPECT_EQ(ask<msrv::GetPositionIK>("/compute_ik", request).error_code.val, MoveItErrorCodes::SUCCESS);
  msrv::GetStateValidity::Request validity;
  validity.robot_state = state(kPose);
  const auto judged = ask<msrv::GetStateValidity>("/check_state_validity", validity);
  EXPECT_FALSE(judged.valid);
  const bool names_it =
      std::any_of(judged.contacts.begin(), judged.contacts.end(), [](const ContactInformation& contact) {
        return (contact.contact_body_1 == "melon" &&
                contact.body_type_1 == ContactInformation::WORLD_OBJECT) ||
               (contact.contact_body_2 == "melon" && contact.body_type_2 == ContactInformation::WORLD_OBJECT);
      });
  EXPECT_TRUE(names_it);
  twin_->engine().find("melon")->place(make_pose({2, 2, 1}, {0, 0, 0}));  // it is moved away
  request.ik_request.avoid_collisions = true;
  EXPECT_EQ(ask<msrv::GetPositionIK>("/compute_ik", request).error_code.val, MoveItErrorCodes::SUCCESS);
}

// B34 (planning_scene.cpp:1887-1995): ADD replaces, MOVE keeps shapes, REMOVE without a name removes all. A
// request after a message finds the scene changed.
TEST_F(ArmServicesTest, ObjectsOfSceneAreAddedMovedAndRemoved) {
  bring_up("omarm_one");
  const auto pose = pose_of("tool_link_1", kPose, "world");
  send("/collision_object", box("crate", pose));
  EXPECT_THAT(touched(kPose), testing::ElementsAre("crate"));
  auto request = ik(pose_of("tool_link_1", kPose));
  request.ik_request.robot_state = state(kPose);
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::GOAL_IN_COLLISION);
  EXPECT_THAT(response.error_code.message, testing::HasSubstr("crate"));
  CollisionObject move = box("crate", pose);
  move.primitives.clear();
  move.pose.position.x += 3;
  move.operation = CollisionObject::MOVE;
  send("/collision_object", move);
  EXPECT_THAT(touched(kPose), testing::IsEmpty());
  CollisionObject more = box("crate", pose);  // a second box, where the first one was
  more.operation = CollisionObject::APPEND;
  send("/collision_object", more);
  EXPECT_THAT(touched(kPose), testing::ElementsAre("crate"));
  CollisionObject far_away = box("crate", move.pose);  // replaces both
  send("/collision_object", far_away);
  EXPECT_THAT(touched(kPose), testing::IsEmpty());
  send("/collision_object", box("second", pose));
  EXPECT_THAT(touched(kPose), testing::ElementsAre("second"));
  CollisionObject all;
  all.operation = CollisionObject::REMOVE;
  send("/collision_object", all);
  EXPECT_THAT(touched(kPose), testing::IsEmpty());
}

// B34: unknown frames are refused, and one shape without a pose of its object gives the object its own
// (:1829).
TEST_F(ArmServicesTest, UnknownFrameOfObjectIsRefusedInLog) {
  std::vector<std::string> lines;
  log_.add_sink([&lines](const LogLine& line) { lines.push_back(line.text); });
  bring_up("omarm_one");
  const auto pose = pose_of("tool_link_1", kPose, "world");
  send("/collision_object", box("crate", pose, "wrold"));
  EXPECT_THAT(touched(kPose), testing::IsEmpty());
  EXPECT_THAT(lines, testing::Contains(testing::HasSubstr("no frame 'wrold'; did you mean 'world'")));
  CollisionObject posed = box("crate", {});
  posed.primitive_poses = {pose};
  posed.subframe_names = {"top"};
  posed.subframe_poses.resize(1);
  send("/collision_object", posed);
  EXPECT_THAT(touched(kPose), testing::ElementsAre("crate"));
  msrv::GetPositionFK::Request fk;
  fk.header.frame_id = "crate/top";
  fk.fk_link_names = {"tool_link_1"};
  fk.robot_state = state(kPose);
  const auto in_object = ask<msrv::GetPositionFK>("/compute_fk", fk);
  ASSERT_EQ(in_object.error_code.val, MoveItErrorCodes::SUCCESS) << in_object.error_code.message;
  const auto& p = in_object.pose_stamped.at(0).pose.position;
  EXPECT_NEAR(std::hypot(p.x, p.y, p.z), 0, 1e-9) << "the object is where its shape is";
}

// B42 (subframes_test.cpp:185, 248): the subframe of an attached object is a tip, that of another one a frame
// for its goal.
TEST_F(ArmServicesTest, SubframeOfAttachedObjectIsMovedToSubframeOfAnother) {
  bring_up("omarm_one");
  const auto tool = pose_of("tool_link_1", kPose, "world");
  CollisionObject table = box("table", tool);
  table.pose.position.z -= 1;
  table.pose.orientation = {0, 0, 0, 1};
  table.subframe_names = {"place"};
  table.subframe_poses.resize(1);
  table.subframe_poses[0].position.z = 1;  // where the tool is
  table.subframe_poses[0].orientation = tool.orientation;
  send("/collision_object", table);
  AttachedCollisionObject peg;
  peg.link_name = "tool_link_1";
  peg.touch_links = {"gripper_base_1", "gripper_finger_left_1", "gripper_finger_right_1"};
  peg.object = box("peg", {}, "tool_link_1");
  peg.object.primitives[0].dimensions = {0.01, 0.01, 0.04};
  peg.object.subframe_names = {"tip"};
  peg.object.subframe_poses.resize(1);
  peg.object.subframe_poses[0].position.z = 0.02;
  send("/attached_collision_object", peg);
  auto request = ik({});
  request.ik_request.ik_link_name = "peg/tip";
  request.ik_request.avoid_collisions = false;
  request.ik_request.robot_state = state(kPose);
  request.ik_request.pose_stamped.header.frame_id = "table/place";
  request.ik_request.pose_stamped.pose.position.z = 0.02;  // so that the tool stays where it is
  const auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  ASSERT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
  for (int i = 1; i <= 6; ++i) {
    EXPECT_NEAR(position(response.solution, "Revolute " + std::to_string(i)),
                kPose[static_cast<std::size_t>(i - 1)], 1e-5);
  }
  request.ik_request.ik_link_name = "table/place";
  EXPECT_THAT(ask<msrv::GetPositionIK>("/compute_ik", request).error_code.message,
              testing::HasSubstr("attached to no link"));
}

// B35, B36 (planning_scene.cpp:1536-1772): an attached object moves with its link, is named as attached,
// and is put back where it is.
TEST_F(ArmServicesTest, AttachedObjectMovesWithLinkAndIsPutBack) {
  bring_up("omarm_one");
  AttachedCollisionObject pole;
  pole.link_name = "tool_link_1";
  pole.object = box("pole", {}, "tool_link_1");
  pole.object.primitives[0].dimensions = {0.02, 0.02, 3};
  send("/attached_collision_object", pole);
  EXPECT_THAT(touched(kPose), testing::Contains("pole")) << "expected it to touch the links before the tool";
  AttachedCollisionObject release;
  release.link_name = "base_link";
  release.object.id = "pole";
  release.object.operation = CollisionObject::REMOVE;
  send("/attached_collision_object", release);
  EXPECT_THAT(touched(kPose), testing::Contains("pole")) << "another link does not hold it";
  release.link_name = "tool_link_1";
  send("/attached_collision_object", release);
  CollisionObject away;
  away.id = "pole";
  away.operation = CollisionObject::MOVE;
  away.header.frame_id = "world";
  away.pose.position.x = 5;
  send("/collision_object", away);
  EXPECT_THAT(touched(kPose), testing::IsEmpty());
}

// B43: an octomap of the scene, as a sensor's, replaced by the next one.
TEST_F(ArmServicesTest, OctomapOfSceneIsObstacle) {
  bring_up("omarm_one");
  const auto tool = pose_of("tool_link_1", kPose, "world");
  moveit_msgs::msg::PlanningSceneWorld scene;
  scene.octomap.header.frame_id = "world";
  scene.octomap.origin.position = tool.position;
  scene.octomap.origin.orientation.w = 1;
  scene.octomap.octomap.id = "OcTree";
  scene.octomap.octomap.resolution = 0.05;
  scene.octomap.octomap.binary = true;
  // Fifteen inner nodes along the first child with the centre of the map in its corner, then eight occupied
  // children: a cube of 10 cm at -10 cm .. 0.
  for (int level = 0; level < 15; ++level) {
    const int child = level == 0 ? 0 : 7;
    const unsigned bits = 3U << (2 * child);
    scene.octomap.octomap.data.push_back(static_cast<std::int8_t>(bits & 0xFF));
    scene.octomap.octomap.data.push_back(static_cast<std::int8_t>(bits >> 8));
  }
  scene.octomap.octomap.data.push_back(static_cast<std::int8_t>(0xAA));
  scene.octomap.octomap.data.push_back(static_cast<std::int8_t>(0xAA));
  send("/planning_scene_world", scene);
  EXPECT_THAT(touched(kPose), testing::ElementsAre("<octomap>"));
  send("/planning_scene_world", moveit_msgs::msg::PlanningSceneWorld{});
  EXPECT_THAT(touched(kPose), testing::IsEmpty());
}

// B28, B44: constraints are judged in their order; a continuous joint is compared over whole turns.
TEST_F(ArmServicesTest, StateValidityJudgesEachConstraint) {
  bring_up("omarm_one");
  msrv::GetStateValidity::Request request;
  request.robot_state = state(kPose);
  moveit_msgs::msg::JointConstraint joint;
  joint.joint_name = "Revolute 2";
  joint.position = kPose[1] + 0.1;
  joint.tolerance_above = joint.tolerance_below = 0.05;
  moveit_msgs::msg::PositionConstraint place;
  place.link_name = "tool_link_1";
  const auto pose = pose_of("tool_link_1", kPose);
  place.constraint_region.primitive_poses = {pose};
  place.constraint_region.primitives.emplace_back();
  place.constraint_region.primitives[0].type = shape_msgs::msg::SolidPrimitive::SPHERE;
  place.constraint_region.primitives[0].dimensions.push_back(0.01);
  moveit_msgs::msg::OrientationConstraint turn;
  turn.link_name = "tool_link_1";
  turn.orientation = pose.orientation;
  turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = turn.absolute_z_axis_tolerance = 0.01;
  request.constraints.joint_constraints = {joint};
  request.constraints.position_constraints = {place};
  request.constraints.orientation_constraints = {turn};
  const auto response = ask<msrv::GetStateValidity>("/check_state_validity", request);
  ASSERT_EQ(response.constraint_result.size(), 3U);
  EXPECT_FALSE(response.constraint_result[0].result);
  EXPECT_NEAR(response.constraint_result[0].distance, 0.1, 1e-9);
  EXPECT_TRUE(response.constraint_result[1].result);
  EXPECT_TRUE(response.constraint_result[2].result);
  EXPECT_FALSE(response.valid);
}

// B27: a pose for a small arm succeeds where the tool's axis can be met, and says what is left free; else
// the least tolerances that would do are in the message.
TEST_F(ArmServicesTest, SmallArmMeetsToolsAxisAndSaysWhatIsFree) {
  bring_up("lab_arm");
  msrv::GetPositionIK::Request request;
  request.ik_request.pose_stamped.pose.position = {0.1, 0.1, 0.2};
  request.ik_request.pose_stamped.pose.orientation = {0, 0, 0, 1};
  auto response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::SUCCESS) << response.error_code.message;
  EXPECT_NE(response.error_code.message.find("the rotation about the tool's axis is free"), std::string::npos)
      << response.error_code.message;
  request.ik_request.pose_stamped.pose.orientation = {0, 0.6, 0, 0.8};
  request.ik_request.pose_stamped.pose.position = {0, 0.2, 0.2};
  response = ask<msrv::GetPositionIK>("/compute_ik", request);
  EXPECT_EQ(response.error_code.val, MoveItErrorCodes::NO_IK_SOLUTION);
  EXPECT_NE(response.error_code.message.find("the least tolerances that would do are"), std::string::npos)
      << response.error_code.message;
}

TEST_F(ArmServicesTest, SolveIkListsBranchesWithTheirMeasures) {
  bring_up("omarm_one");
  dsrv::SolveIk::Request request;
  request.pose.pose = pose_of("tool_link_1", kPose);
  request.every_branch = true;
  const auto response = ask<dsrv::SolveIk>("/doppel/ik", request);
  ASSERT_TRUE(response.solved) << response.message;
  EXPECT_EQ(response.group, "arm");
  EXPECT_EQ(response.tip_link, "tool_link_1");
  ASSERT_FALSE(response.branches.empty());
  for (const doppel_msgs::msg::IkBranch& branch : response.branches) {
    EXPECT_EQ(branch.positions.size(), response.joint_names.size());
    EXPECT_LT(distance(branch.pose, request.pose.pose), 1e-6);
    EXPECT_GT(branch.clearance, 0);
  }
  request.task = "positon";
  const auto refused = ask<dsrv::SolveIk>("/doppel/ik", request);
  EXPECT_EQ(refused.reason, "request");
  EXPECT_NE(refused.message.find("did you mean 'position'"), std::string::npos) << refused.message;
}

TEST_F(ArmServicesTest, SolveIkWithoutSolutionReturnsNearestPose) {
  bring_up("omarm_one");
  dsrv::SolveIk::Request request;
  request.pose.pose.position = {2, 0, 0.1};
  request.pose.pose.orientation.w = 1;
  request.task = "position";
  const auto response = ask<dsrv::SolveIk>("/doppel/ik", request);
  EXPECT_FALSE(response.solved);
  EXPECT_EQ(response.reason, "out_of_reach");
  ASSERT_EQ(response.branches.size(), 1U);
  EXPECT_NEAR(distance(response.branches[0].pose, request.pose.pose), response.branches[0].position_error,
              1e-9);
}

TEST_F(ArmServicesTest, ExtremeNumbersAreRefusedWithReason) {
  bring_up("omarm_one");
  dsrv::GetReach::Request map;
  map.cell = 0.001;
  const auto refused = ask<dsrv::GetReach>("/doppel/reach", map);
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find("use cells of at least"), std::string::npos) << refused.message;
  dsrv::SolveIk::Request far;
  far.pose.pose.position.x = 1e300;
  far.pose.pose.orientation.w = 1;
  const auto answer = ask<dsrv::SolveIk>("/doppel/ik", far);
  EXPECT_EQ(answer.reason, "request");
  EXPECT_NE(answer.message.find("beyond 10 km"), std::string::npos) << answer.message;
}

TEST_F(ArmServicesTest, ReachOfArmIsCloud) {
  bring_up("omarm_one");
  dsrv::GetReach::Request request;
  request.cell = 0.08;
  request.directions = 4;
  const auto response = ask<dsrv::GetReach>("/doppel/reach", request);
  ASSERT_TRUE(response.success) << response.message;
  EXPECT_GT(response.cloud.width, 20U);
  EXPECT_EQ(response.cloud.data.size(), std::size_t{response.cloud.width} * response.cloud.point_step);
  EXPECT_NEAR(response.volume, response.cloud.width * 0.08 * 0.08 * 0.08, 1e-6);
  request.cell = 1e-9;
  EXPECT_FALSE(ask<dsrv::GetReach>("/doppel/reach", request).success);
}

// Two robots: each has its services in its namespace, and is an obstacle for the other.
TEST_F(ArmServicesTest, RobotsHaveServicesInTheirNamespaces) {
  Scenario scenario;
  scenario.robots = {{.target = "omarm_one", .name_space = "left"},
                     {.target = "omarm_one", .name_space = "right"}};
  scenario.robots[1].X_WR = make_pose({1, 0, 0}, {0, 0, 0});
  bring_up(scenario);
  EXPECT_EQ(ask<dsrv::ListArms>("/left/doppel/arms", {}).groups, std::vector<std::string>{"arm"});
  EXPECT_EQ(ask<dsrv::ListArms>("/right/doppel/arms", {}).tip_links, std::vector<std::string>{"tool_link_1"});
}

}  // namespace
}  // namespace doppel::test
