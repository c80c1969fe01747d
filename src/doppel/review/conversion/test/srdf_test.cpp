#include "doppel/review/conversion/srdf.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "conversion_fixture.h"
#include "doppel/description/srdf/srdf.h"
#include "doppel/scenario/resolve/joint_groups.h"

namespace doppel {
namespace {

using testing::ElementsAre;

// A planar arm of spheres at the ends of four links of 0.2 m, on joints that turn about z.
std::string sphere_arm(double radius) {
  std::string xml = "<robot name=\"r\">";
  for (int i = 0; i < 5; ++i) {
    xml += "<link name=\"l" + std::to_string(i) +
           "\"><collision><origin xyz=\"0.2 0 0\"/><geometry><sphere radius=\"" + std::to_string(radius) +
           "\"/></geometry></collision></link>";
    if (i == 0) continue;
    xml +=
        "<joint name=\"j" + std::to_string(i) + "\" type=\"revolute\"><parent link=\"l" +
        std::to_string(i - 1) + "\"/><child link=\"l" + std::to_string(i) +
        "\"/><origin xyz=\"0.2 0 0\"/><axis xyz=\"0 0 1\"/><limit lower=\"-1.2\" upper=\"1.2\" effort=\"1\" "
        "velocity=\"1\"/></joint>";
  }
  return xml + "</robot>";
}

std::map<std::pair<int, int>, DisabledReason> by_pair(const SelfCollisions& found) {
  std::map<std::pair<int, int>, DisabledReason> out;
  for (const DisabledPair& pair : found.disabled) out[{pair.link_a, pair.link_b}] = pair.reason;
  return out;
}

// The same from trigonometry alone, over a grid of all joint positions.
std::map<std::pair<int, int>, DisabledReason> brute_force(double radius) {
  std::map<std::pair<int, int>, int> touched;
  std::map<std::pair<int, int>, bool> at_zero;
  constexpr int kSteps = 13;
  int count = 0;
  for (int code = 0; code < kSteps * kSteps * kSteps * kSteps; ++code) {
    Eigen::Vector2d place[5];
    Eigen::Vector2d at(0, 0);
    double angle = 0;
    for (int i = 0, rest = code; i < 5; ++i) {
      if (i > 0) {
        angle += -1.2 + 2.4 * (rest % kSteps) / (kSteps - 1);
        rest /= kSteps;
      }
      at += 0.2 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      place[i] = at;
    }
    ++count;
    for (int a = 0; a < 5; ++a) {
      for (int b = a + 1; b < 5; ++b)
        touched[{a, b}] += (place[a] - place[b]).norm() < 2 * radius - 1e-6 ? 1 : 0;
    }
  }
  std::map<std::pair<int, int>, DisabledReason> out;
  for (const auto& [pair, times] : touched) {
    const double at_rest = 0.2 * (pair.second - pair.first);
    if (pair.second == pair.first + 1) {
      out[pair] = DisabledReason::adjacent;
    } else if (at_rest < 2 * radius - 1e-6) {
      out[pair] = DisabledReason::by_default;
    } else if (times >= 0.95 * count) {
      out[pair] = DisabledReason::always;
    } else if (times == 0) {
      out[pair] = DisabledReason::never;
    }
  }
  return out;
}

TEST(SelfCollisionTest, AgreesWithBruteForce) {
  for (const double radius : {0.02, 0.09, 0.15, 0.21}) {
    SCOPED_TRACE(radius);
    const Converted converted = from_text(sphere_arm(radius));
    SelfCollisionOptions options;
    options.samples = 20000;
    const SelfCollisions found = find_self_collisions(converted.robot, converted.model, options);
    EXPECT_EQ(found.checked_pairs, 10);
    EXPECT_EQ(by_pair(found), brute_force(radius));
    options.find_never = false;
    auto others = by_pair(found);
    std::erase_if(others, [](const auto& pair) { return pair.second == DisabledReason::never; });
    EXPECT_EQ(by_pair(find_self_collisions(converted.robot, converted.model, options)), others);
  }
}

TEST(SelfCollisionTest, PairsTouchingInNearlyEveryPoseAreAlways) {
  // A ball on a slide that separates from another one only in the last half millimetre of travel, at zero.
  const Converted converted = from_text(
      "<robot name=\"r\"><link name=\"a\"><collision><geometry><sphere "
      "radius=\"0.1\"/></geometry></collision>"
      "</link><link name=\"b\"><collision><origin xyz=\"5 0 0\"/><geometry><sphere "
      "radius=\"0.01\"/></geometry>"
      "</collision></link><link name=\"c\"><collision><geometry><sphere "
      "radius=\"0.05\"/></geometry></collision>"
      "</link><joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>"
      "<joint name=\"k\" type=\"prismatic\"><parent link=\"b\"/><child link=\"c\"/><origin xyz=\"0.1505 0 "
      "0\"/>"
      "<axis xyz=\"1 0 0\"/><limit lower=\"-0.1\" upper=\"0\" effort=\"1\" velocity=\"1\"/></joint></robot>");
  SelfCollisionOptions options;
  options.samples = 1000;
  const auto found = by_pair(find_self_collisions(converted.robot, converted.model, options));
  EXPECT_EQ(found, (std::map<std::pair<int, int>, DisabledReason>{{{0, 1}, DisabledReason::adjacent},
                                                                  {{0, 2}, DisabledReason::always},
                                                                  {{1, 2}, DisabledReason::adjacent}}));
}

TEST(SelfCollisionTest, SameSeedGivesSameResult) {
  const Converted converted = bundled("omarm_one");
  SelfCollisionOptions options;
  options.samples = 200;
  const auto first = by_pair(find_self_collisions(converted.robot, converted.model, options));
  EXPECT_EQ(first, by_pair(find_self_collisions(converted.robot, converted.model, options)));
  EXPECT_FALSE(first.empty());
  options.progress = [](double done) { return done < 0.5; };
  const SelfCollisions cancelled = find_self_collisions(converted.robot, converted.model, options);
  EXPECT_TRUE(cancelled.cancelled);
  EXPECT_TRUE(cancelled.disabled.empty());
}

TEST(SelfCollisionTest, RandomConfigurationsKeepLimitsAndMimics) {
  const Converted converted = from_text(kWholeRobot);
  const Model& model = converted.model;
  std::uint64_t state = 3;
  Eigen::VectorXd low = Eigen::VectorXd::Constant(model.nq, 1e9), high = -low;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::VectorXd q = random_configuration(model, state);
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
    const auto at = [&](const char* name) { return q[model.joints[model.find_joint(name)].q]; };
    ASSERT_DOUBLE_EQ(at("follower"), 1.5 * at("slide") + 0.01);
  }
  const int twist = model.joints[model.find_joint("turn & \"twist\"")].q;
  EXPECT_NEAR(low[twist], -1, 0.02);
  EXPECT_NEAR(high[twist], 2, 0.02);
  EXPECT_GE(low[twist], -1);
  const int wheel = model.joints[model.find_joint("wheel")].q;
  EXPECT_NEAR(low[wheel], -std::numbers::pi, 0.05);
}

// -- groups

std::vector<std::string> names(const Model& model, const PlanningGroup& group) {
  std::vector<std::string> out;
  for (const int joint : group.joints) out.push_back(model.joints[joint].name);
  return out;
}

TEST(PlanningGroupsTest, ControllersDefineGroups) {
  const Converted converted = bundled("omarm_one");
  const auto controllers = joint_groups(controllers_in(ParameterFile::load(
      std::filesystem::path(DOPPEL_SOURCE_DIR) / "robots/omarm_one/config/ros2_controllers.yaml")));
  ASSERT_EQ(controllers.size(), 3u);
  EXPECT_EQ(controllers[2].type, "joint_state_broadcaster/JointStateBroadcaster");
  EXPECT_TRUE(controllers[2].joints.empty());
  const auto groups = find_planning_groups(converted.model, controllers);
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].name, "arm");
  EXPECT_EQ(groups[0].joints.size(), 6u);
  EXPECT_EQ(converted.model.links[groups[0].base_link].name, "base_link");
  EXPECT_EQ(converted.model.links[groups[0].tip_link].name, "tool_link_1");
  EXPECT_EQ(groups[1].name, "gripper");
  EXPECT_THAT(names(converted.model, groups[1]), ElementsAre("Revolute 8", "Revolute 9"));
  EXPECT_EQ(groups[1].parent_group, 0);
  EXPECT_EQ(converted.model.links[groups[1].parent_link].name, "tool_link_1");
}

TEST(PlanningGroupsTest, TreeDefinesGroupsWithoutControllers) {
  const Converted one = bundled("omarm_one");
  const auto groups = find_planning_groups(one.model, {});
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].joints.size(), 6u);
  EXPECT_THAT(names(one.model, groups[1]), ElementsAre("Revolute 8", "Revolute 9"));

  std::string xml = "<robot name=\"two\"><link name=\"base\"/>";
  const auto add = [&xml](const std::string& parent, const std::string& child, const std::string& type) {
    xml += "<link name=\"" + child +
           "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" "
           "iyz=\"0\" izz=\"1\"/></inertial></link><joint name=\"" +
           child + "_joint\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
           "\"/><axis xyz=\"0 0 1\"/><limit lower=\"0\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>";
  };
  for (const std::string side : {"left", "right"}) {
    add("base", side + "_shoulder", "revolute");
    add(side + "_shoulder", side + "_elbow", "revolute");
    add(side + "_elbow", side + "_tool0", "fixed");
    add(side + "_elbow", side + "_finger_a", "prismatic");
    add(side + "_elbow", side + "_finger_b", "prismatic");
  }
  add("base", "wheel", "continuous");
  const Converted two = from_text(xml + "</robot>");
  const auto both = find_planning_groups(two.model, {});
  std::vector<std::string> found;
  for (const PlanningGroup& group : both) found.push_back(group.name);
  EXPECT_THAT(found, ElementsAre("left_arm", "right_arm", "left_gripper", "right_gripper"));
  ASSERT_EQ(both.size(), 4u);
  EXPECT_EQ(two.model.links[both[1].tip_link].name, "right_tool0");
  EXPECT_EQ(both[2].parent_group, 0);
  EXPECT_EQ(both[3].parent_group, 1);
  EXPECT_EQ(two.model.links[both[3].parent_link].name, "right_elbow");
}

TEST(SrdfTest, SrdfHasGroupsStatesAndDisabledPairs) {
  const Converted converted = bundled("omarm_one");
  const auto groups = find_planning_groups(converted.model, {});
  const XmlNode robot =
      parse_xml(to_srdf(converted.model, groups, {{1, 2, DisabledReason::adjacent}}), "out.srdf");
  EXPECT_EQ(robot.find("name")->value, "omarm");
  const XmlNode* arm = robot.first("group");
  ASSERT_NE(arm, nullptr);
  EXPECT_EQ(arm->first("chain")->find("tip_link")->value, "tool_link_1");
  const XmlNode* effector = robot.first("end_effector");
  ASSERT_NE(effector, nullptr);
  EXPECT_EQ(effector->find("parent_link")->value, "tool_link_1");
  EXPECT_EQ(effector->find("parent_group")->value, "arm");
  EXPECT_EQ(robot.first("virtual_joint"), nullptr) << "expected no virtual joint: the root is the world";
  EXPECT_EQ(robot.first("passive_joint")->find("name")->value, "Revolute 9");
  EXPECT_EQ(robot.first("disable_collisions")->find("reason")->value, "Adjacent");
  const Converted whole = from_text(kWholeRobot);
  const XmlNode free = parse_xml(to_srdf(whole.model, {}, {}), "out.srdf");
  EXPECT_EQ(free.first("virtual_joint")->find("child_link")->value, "base_footprint");
}

TEST(SrdfTest, WrittenSpheresCoverTheirLinks) {
  const Converted arm = bundled("lab_arm");
  Diagnostics diagnostics;
  const auto found = find_link_spheres(arm.robot, arm.model, CollisionDetail::triangles, diagnostics);
  EXPECT_THAT(diagnostics.all(), testing::IsEmpty());
  const std::string text = to_srdf(arm.model, {}, {}, found);
  EXPECT_EQ(text, to_srdf(arm.model, {}, {},
                          find_link_spheres(arm.robot, arm.model, CollisionDetail::triangles, diagnostics)));
  const SrdfDescription srdf = read_srdf(parse_xml(text, "out.srdf"), diagnostics);
  const auto with_shapes =
      std::ranges::count_if(arm.robot.links, [](const Link& link) { return !link.collisions.empty(); });
  EXPECT_EQ(static_cast<std::ptrdiff_t>(srdf.spheres.size()), with_shapes);
  const SceneInstance instance = described_robot(arm.robot, arm.model);
  std::size_t count = 0;
  for (const SrdfSpheres& cover : srdf.spheres) {
    SCOPED_TRACE(cover.link);
    std::vector<CoverSphere> spheres;
    for (const SrdfSphere& s : cover.spheres) spheres.push_back({s.center, s.radius});
    count += spheres.size();
    EXPECT_TRUE(covers(spheres, link_geometry(instance, arm.model.find_link(cover.link))));
  }
  EXPECT_LE(count, 90U) << "60 for an arm, and a few for insides";
}

TEST(SrdfTest, LinkWhoseShapeCannotBeReadGetsNoSpheres) {
  const Converted robot = from_text(
      "<robot name=\"r\"><link name=\"a\"><collision><geometry><sphere "
      "radius=\"0.1\"/></geometry></collision>"
      "<collision><geometry><mesh filename=\"gone.stl\"/></geometry></collision></link></robot>");
  Diagnostics diagnostics;
  EXPECT_TRUE(find_link_spheres(robot.robot, robot.model, CollisionDetail::triangles, diagnostics).empty());
  ASSERT_EQ(diagnostics.all().size(), 1U);
  EXPECT_EQ(diagnostics.all()[0].rule, "convert.cover");
}

}  // namespace
}  // namespace doppel
