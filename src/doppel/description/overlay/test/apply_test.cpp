#include <Eigen/Geometry>
#include <random>
#include <sstream>

#include "doppel/base/math/pose.h"
#include "doppel/description/overlay/test/overlay_fixture.h"

namespace doppel {
namespace {

using namespace overlay_test;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr auto kApplied = OperationState::applied;
constexpr auto kThere = OperationState::already_there;

// Every operation, and chains of them on the same facts: applied once they have their effect, and on the
// result (which is what baking leaves) they change nothing more.
class OperationTest : public testing::TestWithParam<const char*> {};

TEST_P(OperationTest, SecondApplicationChangesNothing) {
  Bench bench;
  const Overlay overlay = bench.stamped(GetParam());
  EXPECT_THAT(bench.apply(overlay), Each(kApplied)) << testing::PrintToString(bench.messages);
  const std::string once = bench.text();
  EXPECT_NE(once, Bench().text());
  EXPECT_THAT(bench.apply(overlay), Each(kThere)) << testing::PrintToString(bench.messages);
  EXPECT_EQ(bench.text(), once);
}

// The file is the same after a round trip, fingerprints included.
TEST_P(OperationTest, FileRoundTripIsEqual) {
  Bench bench;
  const Overlay overlay = bench.stamped(GetParam());
  const std::string yaml = to_yaml(overlay);
  const Overlay again = parse_overlay(yaml, "arm.overlay.yaml");
  EXPECT_EQ(to_yaml(again), yaml);
  EXPECT_THAT(bench.apply(again), Each(kApplied)) << yaml;
}

INSTANTIATE_TEST_SUITE_P(
    Every, OperationTest,
    testing::Values(
        "- flip_axis: J 1", "- set_axis: J 1\n  axis: 0 0 1", "- rotate_frame: J 1\n  rpy: [-0.5, 0, 10 deg]",
        "- bake_zero: J 1\n  offset: 45 deg", "- bake_zero: J 2\n  offset: 5 mm",
        "- bake_zero: J 3\n  offset: 12 deg", "- set_origin: J 3\n  xyz: 0 0 0.1\n  rpy: [0, 0, 1]",
        "- set_limit: J 1\n  upper: 190 deg\n  effort: 36 kg cm\n  velocity: 5.2",
        "- set_dynamics: J 1\n  damping: 0.05\n  friction: 0.02",
        "- set_servo: J 1\n  stiffness: 35\n  damping: 1.2\n  armature: 0.01\n  friction: 0.1\n  viscous: "
        "0.05\n"
        "  effort: 36 kg cm\n  velocity: 5.2\n  delay: 0.02\n  backlash: 0.5 deg\n  resolution: 0.0015",
        "- set_servo: J 2\n  stiffness: 900\n  delay: 0.01",
        "- set_servo: J 1\n  stiffness: 35\n- set_servo: J 1\n  stiffness: 30\n  damping: 1",
        "- set_dynamics: J 1\n  damping: 0.05\n- set_servo: J 1\n  viscous: 0.1\n  damping: 2",
        "- set_servo: J 1\n  stiffness: 35\n- rename_joint: J 1\n  to: shoulder",
        "- set_joint_type: J 1\n  type: continuous",
        "- set_inertia: upper\n  mass: 1.1\n  com: 0 0 0.1\n  iyy: 0.01", "- compute_inertia: base",
        "- compute_inertia: base\n  density: 1.2 g/cm^3", "- scale_masses: 3600 g",
        "- attach_to_world:", "- attach_to_world: base\n  xyz: 0 0 1",
        "- add_mimic: J 3\n  leader: J 1\n  multiplier: -1", "- replace_collision: base\n  by: box",
        "- replace_collision: base\n  by: none", "- replace_collision: base\n  by: hull",
        "- replace_collision: base\n  by: decomposition", "- rename_joint: J 1\n  to: shoulder",
        "- rename_link: upper\n  to: upper_arm", "- rename_robot: arm\n  to: my_arm",
        "- add_ros2_control: Hw\n  plugin: a/B\n  joints: [J 1, J 3]\n  params: {device: auto}\n"
        "  initial_values: {J 1: 90 deg}",
        "- remove_link: tip", "- remove_limit: J 1", "- remove_collision: base", "- remove_transmission: t",
        "- remove_gazebo: tip",
        // chains
        "- flip_axis: J 1\n- rotate_frame: J 1\n  rpy: [0.4, 0, 0]\n- bake_zero: J 1\n  offset: 55 deg",
        "- bake_zero: J 1\n  offset: 0.3\n- flip_axis: J 1\n- bake_zero: J 1\n  offset: 0.1",
        "- set_limit: J 1\n  effort: 4\n- rename_joint: J 1\n  to: j1\n- set_limit: j1\n  velocity: 4",
        "- add_mimic: J 3\n  leader: J 1\n- rename_joint: J 1\n  to: shoulder",
        "- set_inertia: upper\n  iyy: 0.01\n- scale_masses: 4 kg",
        "- scale_masses: 4 kg\n- set_inertia: upper\n  mass: 1.1\n  iyy: 0.01",
        "- set_inertia: tip\n  mass: 0.4\n- remove_link: tip",
        "- set_joint_type: J 3\n  type: fixed\n- remove_link: tip",
        "- attach_to_world:\n- rename_link: base\n  to: base_link",
        "- set_inertia: base\n  mass: 3\n- compute_inertia: base\n- scale_masses: 10 kg"));

TEST(Overlay, BakedZeroMatchesWorkedNumbers) {
  Bench bench;
  bench.apply(bench.stamped("- bake_zero: J 1\n  offset: 45 deg"));
  const std::string rpy = bench.value("joint", "J 1", "origin", "rpy");
  EXPECT_NEAR(std::stod(rpy), -1.356194163, 1e-9);
  EXPECT_THAT(rpy, testing::EndsWith(" 0 0"));
  EXPECT_EQ(bench.value("joint", "J 1", "origin", "xyz"), "0 0 0.3");
}

// For any axis, length and frame: at s the corrected joint has the pose of the old one at s - d. Compared
// with quaternions, which the operation does not use.
TEST(Overlay, BakedZeroKeepsPosesForAnyAxis) {
  constexpr unsigned kSeed = 20261121;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> angle(-3, 3), component(-1, 1);
  for (int round = 0; round < 200; ++round) {
    const Eigen::Vector3d axis(component(random), component(random), component(random) + 2.5);
    const Eigen::Vector3d rpy(angle(random), angle(random) / 2.1, angle(random));
    const double d = angle(random), s = angle(random);
    const auto text = [](const Eigen::Vector3d& v) {
      std::ostringstream out;
      out.precision(17);
      out << v.x() << ' ' << v.y() << ' ' << v.z();
      return out.str();
    };
    std::string xml = kArm;
    xml.replace(xml.find("-0.570796 0 0"), 13, text(rpy)).replace(xml.find("1.0 0.0 -0.0"), 12, text(axis));
    Bench bench(xml);
    Overlay overlay = bench.stamped("- bake_zero: J 1\n  offset: 1");
    std::get<BakeZero>(overlay.operations[0].action).offset = d;
    ASSERT_THAT(bench.apply(overlay), ElementsAre(kApplied));
    std::istringstream words(bench.value("joint", "J 1", "origin", "rpy"));
    Eigen::Vector3d made;
    words >> made.x() >> made.y() >> made.z();
    using Q = Eigen::Quaterniond;
    const auto turn = [](double by, const Eigen::Vector3d& about) {
      return Q(Eigen::AngleAxisd(by, about.normalized()));
    };
    const auto frame = [&](const Eigen::Vector3d& v) {
      return turn(v.z(), Eigen::Vector3d::UnitZ()) * turn(v.y(), Eigen::Vector3d::UnitY()) *
             turn(v.x(), Eigen::Vector3d::UnitX());
    };
    ASSERT_LT((frame(made) * turn(s, axis)).angularDistance(frame(rpy) * turn(s - d, axis)), 1e-9)
        << "seed " << kSeed << ", round " << round;
  }
}

// The walkthrough's example: 12 degrees about an axis that is tilted by 10, from rpy 0.
TEST(Overlay, TiltedSampleIsBaked) {
  Bench bench;
  bench.apply(bench.stamped("- bake_zero: J 3\n  offset: 12 deg"));
  std::istringstream words(bench.value("joint", "J 3", "origin", "rpy"));
  Eigen::Vector3d rpy;
  words >> rpy.x() >> rpy.y() >> rpy.z();
  const double half = 6 * 3.14159265358979323846 / 180, length = std::hypot(0.984808, 0.173648);
  const double w = std::cos(half), y = std::sin(half) * 0.984808 / length,
               z = std::sin(half) * 0.173648 / length;
  EXPECT_NEAR(rpy.x(), std::atan2(2 * y * z, 1 - 2 * y * y), 1e-9);
  EXPECT_NEAR(rpy.y(), std::asin(2 * w * y), 1e-9);
  EXPECT_NEAR(rpy.z(), std::atan2(2 * w * z, 1 - 2 * (y * y + z * z)), 1e-9);
}

// A prismatic joint moves back along its axis, which the frame's yaw of 90 degrees turns to y.
TEST(Overlay, PrismaticZeroIsBaked) {
  Bench bench;
  bench.apply(bench.stamped("- bake_zero: J 2\n  offset: 5 mm"));
  const std::string xyz = bench.value("joint", "J 2", "origin", "xyz");
  EXPECT_EQ(xyz, "0.1 -0.005 0");
}

TEST(Overlay, ChangedTargetIsReportedAndUnmodified) {
  Bench made;
  const Overlay overlay = made.stamped("- flip_axis: J 1\n  why: it turns the other way");
  Bench bench(std::string(kArm).replace(std::string(kArm).find("1.0 0.0 -0.0"), 12, "0 0 1"));
  const std::string before = bench.text();
  EXPECT_THAT(bench.apply(overlay), ElementsAre(OperationState::changed));
  EXPECT_EQ(bench.text(), before);
  ASSERT_EQ(bench.diagnostics.all().size(), 1U);
  EXPECT_EQ(bench.diagnostics.all()[0].rule, "overlay.changed");
  EXPECT_THAT(bench.messages[0], HasSubstr("axis of joint 'J 1' is now 0 0 1"));
}

TEST(Overlay, CorrectionInCadIsAlreadyThere) {
  Bench made;
  const Overlay overlay = made.stamped("- flip_axis: J 1\n- bake_zero: J 1\n  offset: 0.1");
  Bench bench(std::string(kArm).replace(std::string(kArm).find("1.0 0.0 -0.0"), 12, "-1 0 0"));
  EXPECT_THAT(bench.apply(overlay), ElementsAre(kThere, kApplied));
  Bench both;
  both.apply(overlay);
  EXPECT_EQ(bench.value("joint", "J 1", "origin", "rpy"), both.value("joint", "J 1", "origin", "rpy"));
}

TEST(Overlay, PartlyCorrectedTargetGetsRest) {
  Bench made;
  const Overlay overlay = made.stamped("- set_limit: J 1\n  effort: 3.5\n  velocity: 5.2");
  std::string xml = kArm;
  xml.replace(xml.find("effort=\"100\""), 12, "effort=\"3.5\"");
  Bench bench(xml);
  EXPECT_THAT(bench.apply(overlay), ElementsAre(kApplied));
  EXPECT_EQ(bench.value("joint", "J 1", "limit", "velocity"), "5.2");
}

TEST(Overlay, MissingTargetIsReportedWithNearest) {
  Bench bench;
  Overlay overlay = bench.stamped("- flip_axis: J 1");
  std::get<FlipAxis>(overlay.operations[0].action).joint = "J1";
  EXPECT_THAT(bench.apply(overlay), ElementsAre(OperationState::no_target));
  EXPECT_THAT(bench.messages[0], HasSubstr("did you mean 'J 1'"));
}

TEST(Overlay, OperationWithoutFingerprintIsNotApplied) {
  Bench bench;
  EXPECT_THAT(bench.apply(parse_overlay("- flip_axis: J 1", "o.yaml")),
              ElementsAre(OperationState::no_fingerprint));
  EXPECT_EQ(bench.text(), Bench().text());
}

TEST(Overlay, RenameChangesEveryReference) {
  std::string xml = kArm;
  xml.replace(xml.find("</robot>"), 8,
              R"(<joint name="J 4" type="revolute"><parent link="base"/><child link="ear"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="J 1"/></joint><link name="ear"/>
  <ros2_control name="c" type="system"><hardware><plugin>p</plugin></hardware><joint name="J 1"/></ros2_control>
  <gazebo><plugin filename="f" name="n"><joint_name>J 1</joint_name><other>J 1</other></plugin></gazebo></robot>)");
  Bench bench(xml);
  bench.apply(bench.stamped("- rename_joint: J 1\n  to: shoulder"));
  const std::string text = bench.text();
  EXPECT_EQ(bench.value("joint", "J 4", "mimic", "joint"), "shoulder");
  EXPECT_EQ(bench.value("ros2_control", "c", "joint", "name"), "shoulder");
  EXPECT_EQ(bench.value("transmission", "t", "joint", "name"), "shoulder");
  EXPECT_THAT(text, HasSubstr("<joint_name>shoulder</joint_name>"));
  EXPECT_THAT(text, HasSubstr("<other>J 1</other>"));
  EXPECT_THAT(text, HasSubstr("<gazebo reference=\"shoulder\">"));
  EXPECT_EQ(text.find("name=\"J 1\""), std::string::npos);
}

TEST(Overlay, RemoveLinkRemovesReferences) {
  Bench bench;
  bench.apply(bench.stamped("- remove_link: tip"));
  EXPECT_EQ(bench.text().find("tip"), std::string::npos);
  EXPECT_EQ(bench.text().find("J 3"), std::string::npos);
}

TEST(Overlay, OperationBreakingTreeIsRefused) {
  for (const char* yaml : {"- remove_link: upper\n  was: {joint: J 1, parent: base}",
                           "- remove_joint: J 1\n  was: {parent: base, child: upper}"}) {
    Bench bench;
    bench.apply(parse_overlay(yaml, "o.yaml"));
    EXPECT_FALSE(bench.diagnostics.has_errors()) << yaml << ": expected the rest to load";
    EXPECT_EQ(bench.diagnostics.all()[0].rule, "overlay.impossible");
    EXPECT_EQ(bench.text(), Bench().text());
  }
}

TEST(Overlay, StaleOperationDoesNotBlockOthers) {
  Bench bench;
  const auto states = bench.apply(
      parse_overlay("- add_ros2_control: arm\n  plugin: p/P\n  joints: [J 1, J 44]\n  was: {plugin: none}\n"
                    "- set_limit: J 1\n  effort: 2\n  was: {effort: 100}",
                    "o.yaml"));
  EXPECT_EQ(states, (std::vector{OperationState::changed, OperationState::applied}));
  EXPECT_FALSE(bench.diagnostics.has_errors());
  EXPECT_THAT(bench.diagnostics.all()[0].message, HasSubstr("is not applied: the ros2_control block 'arm'"));
  EXPECT_EQ(bench.text().find("<ros2_control"), std::string::npos) << "expected no partial block";
}

TEST(Overlay, AngleWithoutUnitIsReported) {
  const auto rules = [](const std::string& yaml) {
    Bench bench;
    const Overlay overlay = bench.stamped(yaml);
    bench.apply(overlay);
    std::string out;
    for (const Diagnostic& said : bench.diagnostics.all()) out += said.rule + ' ' + said.message;
    return out;
  };
  EXPECT_THAT(rules("- bake_zero: J 1\n  offset: 45"), HasSubstr("overlay.degrees"));
  EXPECT_THAT(rules("- bake_zero: J 1\n  offset: 45"), HasSubstr("did you mean 45 deg?"));
  EXPECT_THAT(rules("- set_limit: J 1\n  upper: 120"), HasSubstr("did you mean 120 deg?"));
  EXPECT_THAT(rules("- rotate_frame: J 1\n  rpy: [0, 0, 90]"), HasSubstr("did you mean 90 deg?"));
  EXPECT_THAT(rules("- set_origin: J 1\n  rpy: 0 0 90"), HasSubstr("did you mean 90 deg?"));
  for (const char* fine : {"- bake_zero: J 1\n  offset: 45 deg", "- set_limit: J 1\n  upper: 12.57 rad",
                           "- set_limit: J 1\n  upper: 720 deg", "- set_limit: J 1\n  upper: 6.2832",
                           "- set_limit: J 2\n  upper: 7", "- set_limit: J 1\n  velocity: 120",
                           "- rotate_frame: J 1\n  rpy: 0 0 450 deg", "- set_origin: J 1\n  xyz: 0 0 12"})
    EXPECT_EQ(rules(fine), "") << fine;
}

TEST(Overlay, AngleOfSeveralTurnsKeepsUnit) {
  for (const char* yaml : {"- set_limit: J\n  upper: 12.57 rad\n", "- bake_zero: J\n  offset: 720 deg\n",
                           "- set_limit: J\n  upper: 7 m\n", "- bake_zero: J\n  offset: 45\n",
                           "- rotate_frame: J\n  rpy: [0, 0, 12.5 rad]\n"})
    EXPECT_EQ(to_yaml(parse_overlay(yaml, "o.yaml")), yaml);
}

TEST(Overlay, BakedRemovalExplainsMissingTargets) {
  for (const char* yaml : {"- scale_masses: 7 kg\n- remove_link: tip",
                           "- replace_collision: base\n  by: box\n- remove_collision: base",
                           "- set_inertia: base\n  mass: 3\n- remove_inertial: base",
                           "- set_limit: J 1\n  effort: 3\n- remove_limit: J 1"}) {
    Bench bench;
    const Overlay overlay = bench.stamped(yaml);
    bench.apply(overlay);
    EXPECT_EQ(bench.apply(overlay), (std::vector<OperationState>(2, OperationState::already_there)))
        << yaml << ": " << bench.messages[0] << bench.messages[1];
  }
}

TEST(Overlay, BakedOverlayIsSingleNote) {
  Bench bench;
  const Overlay overlay = bench.stamped("- flip_axis: J 1\n- set_limit: J 1\n  effort: 2");
  bench.apply(overlay);
  EXPECT_TRUE(bench.diagnostics.all().empty());
  bench.apply(overlay);
  ASSERT_EQ(bench.diagnostics.all().size(), 1U);
  EXPECT_EQ(bench.diagnostics.all()[0].fix, "the overlay can be deleted");
}

TEST(Overlay, SecondAttachToWorldIsRefused) {
  Bench bench;
  bench.apply(bench.stamped("- attach_to_world:"));
  Operation again = parse_overlay("- attach_to_world:", "o.yaml").operations.front();
  try {
    take_fingerprint(again, bench.description);
    FAIL() << "expected an error: it exists already";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("root is already a link 'world'"));
  }
}

TEST(Overlay, ScaleMassesScalesTensors) {
  Bench bench;
  bench.apply(bench.stamped("- scale_masses: 7 kg"));
  EXPECT_EQ(bench.value("link", "base", "inertial", "none"), "none");
  const XmlNode* inertial = bench.element("link", "base").first("inertial");
  EXPECT_EQ(inertial->first("mass")->find("value")->value, "4");
  EXPECT_EQ(inertial->first("inertia")->find("ixx")->value, "0.04");
}

TEST(Overlay, ComputeInertiaOfBoxIsExact) {
  Bench bench;
  bench.apply(bench.stamped("- compute_inertia: base"));
  const XmlNode* inertial = bench.element("link", "base").first("inertial");
  EXPECT_EQ(inertial->first("origin")->find("xyz")->value, "0 0 0.1");
  EXPECT_NEAR(std::stod(inertial->first("inertia")->find("ixx")->value), 2.0 / 12 * (0.04 + 0.09), 1e-8);
  EXPECT_NEAR(std::stod(inertial->first("inertia")->find("izz")->value), 2.0 / 12 * (0.01 + 0.04), 1e-8);
}

TEST(Overlay, ServoIsWrittenToPlacesOfItsValues) {
  Bench bench;
  bench.apply(
      bench.stamped("- set_servo: J 1\n  stiffness: 35\n  damping: 1.2\n  viscous: 0.05\n  friction: 0.1\n"
                    "  effort: 3.5\n  velocity: 5"));
  EXPECT_EQ(bench.value("joint", "J 1", "dynamics", "damping"), "0.05");
  EXPECT_EQ(bench.value("joint", "J 1", "dynamics", "friction"), "0.1");
  EXPECT_EQ(bench.value("joint", "J 1", "limit", "effort"), "3.5");
  EXPECT_EQ(bench.value("joint", "J 1", "limit", "velocity"), "5");
  EXPECT_THAT(to_xml(bench.description.root), HasSubstr("<doppel:servo stiffness=\"35\" damping=\"1.2\"/>"));
}

TEST(Overlay, EditedNodesKeepLocations) {
  Bench bench;
  bench.apply(bench.stamped("\n\n- set_dynamics: J 1\n  damping: 1\n- set_limit: J 1\n  effort: 2"));
  const XmlNode& joint = bench.element("joint", "J 1");
  EXPECT_EQ(joint.first("dynamics")->where.place(), "arm.overlay.yaml:3:3");
  EXPECT_EQ(*joint.first("limit")->find("effort")->where.file, "arm.urdf");
}

}  // namespace
}  // namespace doppel
