#include "doppel/scenario/compile/base_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/description/urdf/legs.h"
#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

BaseChoice choice(const std::string& inside) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  return choose_base(parse_urdf("<robot name='r'>" + inside + "</robot>", "r.urdf", resolver, diagnostics));
}

std::string link(const std::string& name, const std::string& inside = "") {
  return "<link name='" + name + "'>" + inside + "</link>";
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& axis = "0 0 1") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
         child + "'/><axis xyz='" + axis + "'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>";
}

const std::string kBox = "<collision><geometry><box size='0.1 0.1 0.1'/></geometry></collision>";
const std::string kDisc =
    "<collision><origin rpy='1.570796 0 0'/><geometry><cylinder radius='0.1' "
    "length='0.04'/></geometry></collision>";

TEST(BaseChoice, NamesAreSplitIntoWords) {
  EXPECT_THAT(words_of_name("LHipYawPitch"), ElementsAre("l", "hip", "yaw", "pitch"));
  EXPECT_THAT(words_of_name("left_knee2_joint"), ElementsAre("left", "knee", "joint"));
  EXPECT_THAT(words_of_name("FR_HAA"), ElementsAre("fr", "haa"));
  EXPECT_THAT(words_of_name(""), ElementsAre());
}

TEST(BaseChoice, ArmIsFixed) {
  const BaseChoice arm = choice(link("base_link", kBox) + link("shoulder", kBox) + link("single_gear", kBox) +
                                joint("shoulder_pan", "revolute", "base_link", "shoulder") +
                                joint("legato", "revolute", "shoulder", "single_gear"));
  EXPECT_EQ(arm.kind, BaseKind::fixed);
  EXPECT_THAT(arm.reason, HasSubstr("the description has no signs of wheels or legs"));
}

TEST(BaseChoice, TwoWheelsByNameFloat) {
  const std::string body =
      link("base_link", kBox) + link("l", kBox) + joint("left_wheel_joint", "continuous", "base_link", "l");
  EXPECT_EQ(choice(body).kind, BaseKind::fixed) << "expected a fixed base: a single wheel may be a turntable";
  const BaseChoice two =
      choice(body + link("r", kBox) + joint("right_wheel_joint", "continuous", "base_link", "r"));
  EXPECT_EQ(two.kind, BaseKind::floating);
  EXPECT_THAT(two.reason, HasSubstr("'left_wheel_joint', 'right_wheel_joint'"));
}

TEST(BaseChoice, DiscsOnAxesAreWheels) {
  const std::string frame = link("base_link", kBox) + link("a", kDisc) + link("b", kDisc);
  EXPECT_EQ(choice(frame + joint("ja", "continuous", "base_link", "a", "0 1 0") +
                   joint("jb", "continuous", "base_link", "b", "0 1 0"))
                .kind,
            BaseKind::floating);
  EXPECT_EQ(choice(frame + joint("ja", "continuous", "base_link", "a", "0 1 0") +
                   joint("jb", "continuous", "a", "b", "0 1 0"))
                .kind,
            BaseKind::fixed)
      << "expected a fixed base: only one of the discs is at the end of a chain";
  EXPECT_EQ(choice(frame + joint("ja", "continuous", "base_link", "a", "1 0 0") +
                   joint("jb", "continuous", "base_link", "b", "1 0 0"))
                .kind,
            BaseKind::fixed)
      << "expected a fixed base: discs do not roll about these axes";
}

// Two knees that turn on, with what is round about them or behind them.
std::string knees(const std::string& shank, const std::string& below = "") {
  std::string out = link("base_link", kBox);
  for (const std::string side : {"l", "r"})
    out += link(side, shank) + joint(side + "_k", "continuous", "base_link", side, "0 1 0") +
           (below.empty()
                ? ""
                : link(side + "_tip", below) + "<joint name='" + side + "_fix' type='fixed'><parent link='" +
                      side + "'/><child link='" + side + "_tip'/><origin xyz='0 0 -0.3'/></joint>");
  return out;
}

TEST(BaseChoice, RoundPartsOfLegsAreNotWheels) {
  const std::string ball =
      "<collision><origin xyz='0 0 -0.3'/><geometry><sphere radius='0.03'/></geometry></collision>";
  const std::string tip = "<collision><geometry><sphere radius='0.03'/></geometry></collision>";
  EXPECT_THAT(choice(knees(kDisc)).reason, HasSubstr("it has wheels")) << "expected wheels without feet";
  EXPECT_EQ(choice(knees(ball)).kind, BaseKind::fixed) << "expected no wheel: a ball beside the axis";
  EXPECT_EQ(choice(knees(kDisc + ball)).kind, BaseKind::fixed) << "expected no wheel: the foot is lower";
  EXPECT_EQ(choice(knees(kDisc, tip)).kind, BaseKind::fixed) << "expected no wheel: a fixed foot is lower";
}

TEST(BaseChoice, LegsFloatButHipAloneDoesNot) {
  const std::string links = link("trunk", kBox) + link("a", kBox) + link("b", kBox);
  const BaseChoice leg =
      choice(links + joint("hip", "revolute", "trunk", "a") + joint("knee", "revolute", "a", "b"));
  EXPECT_EQ(leg.kind, BaseKind::floating);
  EXPECT_THAT(leg.reason, HasSubstr("it has legs ('knee')"));
  EXPECT_EQ(
      choice(links + joint("hip_pan", "revolute", "trunk", "a") + joint("hip_tilt", "revolute", "a", "b"))
          .kind,
      BaseKind::fixed);
  EXPECT_EQ(choice(links + link("left_foot", kBox) + link("right_foot", kBox) +
                   joint("pan", "revolute", "trunk", "a") + joint("tilt", "revolute", "a", "b") +
                   joint("f1", "fixed", "trunk", "left_foot") + joint("f2", "fixed", "trunk", "right_foot"))
                .kind,
            BaseKind::fixed)
      << "expected a fixed base: these are the feet of a stand";
  EXPECT_EQ(choice(links + link("lf_foot", kBox) + joint("lf_1", "revolute", "trunk", "a") +
                   joint("lf_2", "revolute", "a", "b") + joint("lf_3", "fixed", "b", "lf_foot"))
                .kind,
            BaseKind::floating)
      << "expected a floating base: a foot at the end of a leg, on a fixed joint";
}

TEST(BaseChoice, WheelsLimitedToManyTurnsFloat) {
  const auto wheel = [](const std::string& name, const std::string& child) {
    return "<joint name='" + name + "' type='revolute'><parent link='base_link'/><child link='" + child +
           "'/><axis xyz='0 1 0'/><limit lower='-180' upper='180' effort='1' velocity='1'/></joint>";
  };
  EXPECT_EQ(choice(link("base_link", kBox) + link("a", kBox) + link("b", kBox) + wheel("wheel1", "a") +
                   wheel("wheel2", "b"))
                .kind,
            BaseKind::floating);
}

TEST(BaseChoice, TurntablesAreNotWheels) {
  const std::string disc =
      "<collision><geometry><cylinder radius='0.1' length='0.04'/></geometry></collision>";
  EXPECT_EQ(choice(link("base_link", kBox) + link("a", disc) + link("b", disc) +
                   joint("ja", "continuous", "base_link", "a") + joint("jb", "continuous", "base_link", "b"))
                .kind,
            BaseKind::fixed);
}

TEST(BaseChoice, MissingCollisionMeshesAreNoWheels) {
  const std::string mesh =
      "<collision><geometry><mesh filename='package://nowhere_at_all/a.stl'/></geometry></collision>";
  const BaseChoice found = choice(link("base_link", mesh) + link("l", mesh) + link("r", mesh) +
                                  joint("left_wheel", "continuous", "base_link", "l") +
                                  joint("right_wheel", "continuous", "base_link", "r"));
  EXPECT_EQ(found.kind, BaseKind::fixed);
  EXPECT_THAT(found.reason, HasSubstr("none of its collision meshes is found"));
}

TEST(BaseChoice, LowerLinkBehindHipIsLeg) {
  const auto limb = [](const std::string& first) {
    return choice(link("body", kBox) + link(first + "0") + link("upper0", kBox) + link("lower0", kBox) +
                  joint("8", "revolute", "body", first + "0", "1 0 0") +
                  joint("0", "revolute", first + "0", "upper0", "0 1 0") +
                  joint("1", "revolute", "upper0", "lower0", "0 1 0"));
  };
  EXPECT_THAT(limb("hip").reason, HasSubstr("it has legs ('lower0')"));
  EXPECT_EQ(limb("shoulder").kind, BaseKind::fixed);
}

TEST(BaseChoice, ShapesWithoutSizeCannotStand) {
  const std::string point = "<collision><geometry><sphere radius='0'/></geometry></collision>";
  const BaseChoice points = choice(link("base_link") + link("thigh") + link("foot", point) +
                                   joint("hip", "revolute", "base_link", "thigh", "0 1 0") +
                                   joint("knee", "revolute", "thigh", "foot", "0 1 0"));
  EXPECT_EQ(points.kind, BaseKind::fixed);
  EXPECT_THAT(points.reason, HasSubstr("none of its collision shapes has a size"));
}

TEST(BaseChoice, FootprintAndPluginsOfMobileBasesFloat) {
  EXPECT_EQ(choice(link("base_footprint") + link("base_link", kBox) +
                   joint("j", "fixed", "base_footprint", "base_link"))
                .kind,
            BaseKind::floating);
  const BaseChoice plugin =
      choice(link("base_link", kBox) +
             "<gazebo><plugin name='drive' filename='libgazebo_ros_diff_drive.so'/></gazebo>");
  EXPECT_EQ(plugin.kind, BaseKind::floating);
  EXPECT_THAT(plugin.reason, HasSubstr("'libgazebo_ros_diff_drive.so'"));
}

TEST(BaseChoice, LinkWorldAndMissingShapesAreFixed) {
  const std::string wheels = link("l") + link("r") + joint("left_wheel", "continuous", "base_link", "l") +
                             joint("right_wheel", "continuous", "base_link", "r");
  EXPECT_THAT(choice(link("base_link") + wheels).reason, HasSubstr("no <collision>"));
  const BaseChoice held =
      choice(link("world") + link("base_link", kBox) + joint("held", "fixed", "world", "base_link") + wheels);
  EXPECT_EQ(held.kind, BaseKind::fixed);
  EXPECT_THAT(held.reason, HasSubstr("'world'"));
}

}  // namespace
}  // namespace doppel
