// Groups of robots without controllers, in the shapes that public descriptions have.
#include "doppel/robot/semantics/planning_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using testing::ElementsAre;

// Joints that are added one by one; each is revolute unless it is changed.
class GroupedRobot {
 public:
  GroupedRobot() { robot_.links.push_back(test::make_frame("base")); }

  Joint& add(const std::string& name, const std::string& parent, const std::string& child) {
    robot_.links.push_back(test::make_link(child, 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3}));
    robot_.joints.push_back(
        test::make_joint(name, JointType::revolute, parent, child, {0, 0, 0.1}, {0, 1, 0}));
    test::limit(robot_.joints.back(), -1, 1, 10, 1);
    return robot_.joints.back();
  }

  void follow(const std::string& name, const std::string& parent, const std::string& child,
              const std::string& leader) {
    add(name, parent, child).mimic = Mimic{leader, -1.0, 0.0, {}};
  }

  // "arm: shoulder elbow", in the order of the groups.
  [[nodiscard]] std::vector<std::string> groups() const {
    Diagnostics diagnostics;
    const Model model = compile_model(robot_, BaseKind::fixed, diagnostics);
    std::vector<std::string> out;
    for (const PlanningGroup& group : find_planning_groups(model, {})) {
      out.push_back(group.name + ":");
      for (const int joint : group.joints) out.back() += " " + model.joints[joint].name;
    }
    return out;
  }

 private:
  RobotDescription robot_;
};

TEST(PlanningGroups, JointUnderGripperBodyIsPartOfArm) {
  GroupedRobot robot;
  robot.add("shoulder", "base", "upper_arm");
  robot.add("wrist_roll", "upper_arm", "gripper");
  robot.add("gripper", "gripper", "jaw");
  EXPECT_THAT(robot.groups(), ElementsAre("arm: shoulder wrist_roll", "gripper: gripper"));
}

TEST(PlanningGroups, FingersOfSeveralJointsAreGripper) {
  GroupedRobot robot;
  robot.add("shoulder", "base", "upper_arm");
  robot.add("j1", "upper_arm", "finger_a");
  robot.add("j2", "finger_a", "finger_b");
  EXPECT_THAT(robot.groups(), ElementsAre("arm: shoulder", "gripper: j1 j2"));
}

TEST(PlanningGroups, ArmJointMayLeadMimicJointBesideIt) {
  GroupedRobot robot;
  robot.add("j1", "base", "link1");
  robot.add("j2", "link1", "link2");
  robot.follow("cylinder_joint", "link1", "cylinder", "j2");
  robot.add("j3", "link2", "link3");
  EXPECT_THAT(robot.groups(), ElementsAre("arm: j1 j2 j3"));
}

TEST(PlanningGroups, MimicJointInsideArmDoesNotDivideIt) {
  GroupedRobot robot;
  robot.add("j1", "base", "link1");
  robot.add("j2", "link1", "link2");
  robot.follow("j2b", "link2", "link2b", "j2");
  robot.add("j3", "link2b", "link3");
  EXPECT_THAT(robot.groups(), ElementsAre("arm: j1 j2 j3"));
}

TEST(PlanningGroups, FingersOfHandAloneAreArms) {
  GroupedRobot robot;
  for (const std::string finger : {"thumb", "finger"}) {
    robot.add(finger + "_1", "base", finger + "_upper");
    robot.add(finger + "_2", finger + "_upper", finger + "_middle");
    robot.add(finger + "_3", finger + "_middle", finger + "_lower");
  }
  EXPECT_THAT(robot.groups(),
              ElementsAre("arm: thumb_1 thumb_2 thumb_3", "arm_2: finger_1 finger_2 finger_3"));
}

// Names of Go2, ANYmal, Romeo, simple_humanoid and a laboratory's table with two arms.
TEST(PlanningGroups, PartsOfBodyAreNamedWithTheirSides) {
  GroupedRobot four_legs;
  for (const std::string leg : {"FL", "FR", "RL", "RR"}) {
    four_legs.add(leg + "_hip_joint", "base", leg + "_hip");
    four_legs.add(leg + "_calf_joint", leg + "_hip", leg + "_calf");
  }
  EXPECT_THAT(
      four_legs.groups(),
      ElementsAre("front_left_leg: FL_hip_joint FL_calf_joint", "front_right_leg: FR_hip_joint FR_calf_joint",
                  "rear_left_leg: RL_hip_joint RL_calf_joint", "rear_right_leg: RR_hip_joint RR_calf_joint"));
  GroupedRobot humanoid;
  humanoid.add("waist_yaw", "base", "torso");
  humanoid.add("HeadPitch", "torso", "HeadPitchLink");
  for (const std::string side : {"L", "R"}) {
    humanoid.add(side + "ShoulderPitch", "torso", side + "1");
    humanoid.add(side + "ElbowYaw", side + "1", side + "2");
    humanoid.add(side + "LEG_HIP_R", "base", side + "3");
    humanoid.add(side + "LEG_KNEE", side + "3", side + "4");
  }
  EXPECT_THAT(humanoid.groups(), testing::UnorderedElementsAre("torso: waist_yaw", "head: HeadPitch",
                                                               "left_arm: LShoulderPitch LElbowYaw",
                                                               "right_arm: RShoulderPitch RElbowYaw",
                                                               "left_leg: LLEG_HIP_R LLEG_KNEE",
                                                               "right_leg: RLEG_HIP_R RLEG_KNEE"));
  GroupedRobot table;
  for (const std::string side : {"lh", "rh"}) {
    table.add(side + "_J1", "base", side + "_one");
    table.add(side + "_J2", side + "_one", side + "_two");
  }
  EXPECT_THAT(table.groups(), ElementsAre("left_arm: lh_J1 lh_J2", "right_arm: rh_J1 rh_J2"));
}

TEST(PlanningGroups, GripperAloneStaysGripper) {
  GroupedRobot robot;
  robot.add("knuckle", "base", "left_finger");
  robot.follow("other_knuckle", "base", "right_finger", "knuckle");
  EXPECT_THAT(robot.groups(), ElementsAre("gripper: knuckle other_knuckle"));
}

}  // namespace
}  // namespace doppel
