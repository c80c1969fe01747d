// Joints of SDF as trees of links.
#include <gmock/gmock.h>

#include <numbers>

#include "doppel/scenario/sdf/test/sdf_fixture.h"

namespace doppel {
namespace {

using std::numbers::pi;

TEST(SdfJoint, RevoluteJointTurnsAboutOwnPoint) {
  const ReadSdf read = read_world(model(
      "a",
      links(2) +
          "<joint name='j' type='revolute'><pose>-0.5 0 0 0 0 0</pose><parent>l0</parent><child>l1</child>"
          "<axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>"));
  const RobotDescription& robot = *read.model("a").description;
  const Joint& joint = *robot.find_joint("j");
  EXPECT_EQ(joint.type, JointType::revolute);
  EXPECT_EQ(joint.origin.xyz, Eigen::Vector3d(0.5, 0, 0));
  EXPECT_EQ(joint.limits->upper, 2);
  EXPECT_TRUE(link_pose(read.model("a"), "l1").translation().isApprox(Eigen::Vector3d(1, 0, 0)));
  EXPECT_EQ(joint.child, "j_frame");
}

TEST(SdfJoint, AxisIsInNamedFrame) {
  const std::string turned =
      "<link name='l0'/><link name='l1'><pose>0 0 0 0 0 1.5707963267948966</pose></link>"
      "<joint name='j' type='prismatic'><parent>l0</parent><child>l1</child><axis><xyz";
  const ReadSdf own = read_world(model("a", turned + ">1 0 0</xyz></axis></joint>"));
  EXPECT_EQ(own.model("a").description->find_joint("j")->axis, Eigen::Vector3d::UnitX());
  const ReadSdf of_model =
      read_world(model("a", turned + " expressed_in='__model__'>1 0 0</xyz></axis></joint>"));
  EXPECT_TRUE(
      of_model.model("a").description->find_joint("j")->axis.isApprox(-Eigen::Vector3d::UnitY(), 1e-12));
  const ReadSdf old = read_world(model("a", turned + ">1 0 0</xyz></axis></joint>"), "1.4");
  EXPECT_TRUE(old.model("a").description->find_joint("j")->axis.isApprox(-Eigen::Vector3d::UnitY(), 1e-12));
}

TEST(SdfJoint, JointTowardsRootIsReversed) {
  const ReadSdf read = read_world(model(
      "a", links(2) + "<joint name='j' type='prismatic'><parent>l1</parent><child>l0</child><axis><xyz>0 1 "
                      "0</xyz></axis></joint>"));
  const Joint& joint = *read.model("a").description->find_joint("j");
  EXPECT_EQ(joint.parent, "l0");
  EXPECT_EQ(joint.axis, -Eigen::Vector3d::UnitY());
}

TEST(SdfJoint, JointToWorldFixesModel) {
  const std::string fixed = "<joint name='j' type='fixed'><parent>world</parent><child>l0</child></joint>";
  const ReadSdf read = read_world(model("a", links(1) + fixed));
  EXPECT_EQ(read.model("a").base, BaseKind::fixed);
  EXPECT_EQ(read.model("a").description->links.size(), 1u);
  const ReadSdf hinge = read_world(
      model("a", "<pose>0 0 2 0 0 0</pose>" + links(1) +
                     "<joint name='j' type='revolute'><parent>world</parent><child>l0</child><axis><xyz>1 0 "
                     "0</xyz></axis></joint>"));
  EXPECT_EQ(hinge.model("a").description->links[0].name, "world");
  EXPECT_EQ(hinge.model("a").description->find_joint("j")->type, JointType::continuous);
  EXPECT_TRUE(link_pose(hinge.model("a"), "l0").translation().isApprox(Eigen::Vector3d(0, 0, 2)));
}

TEST(SdfJoint, EveryTypeIsComposed) {
  const auto made = [](const std::string& type, const std::string& more = "") {
    return read_world(model("a", links(2) + "<joint name='j' type='" + type +
                                     "'><parent>l0</parent><child>l1</child><axis><xyz>0 0 1</xyz></axis>"
                                     "<axis2><xyz>0 1 0</xyz></axis2>" +
                                     more + "</joint>"));
  };
  EXPECT_EQ(made("fixed").model("a").description->joints.size(), 1u);
  EXPECT_EQ(made("ball").model("a").description->joints.size(), 3u);
  EXPECT_EQ(made("universal").model("a").description->find_joint("j_2")->axis, Eigen::Vector3d::UnitY());
  EXPECT_EQ(made("revolute2").model("a").description->joints.size(), 2u);
  const ReadSdf screw = made("screw", "<screw_thread_pitch>0.01</screw_thread_pitch>");
  const Joint& slide = *screw.model("a").description->find_joint("j_slide");
  EXPECT_NEAR(slide.mimic->multiplier, 0.01 / (2 * pi), 1e-15);
  EXPECT_EQ(made("ball").count("sdf.composed_joint"), 1);
  EXPECT_EQ(made("wobbly").count("sdf.unsupported_joint"), 1);
}

TEST(SdfJoint, GearboxCouplesJointsOnReferenceBody) {
  const std::string hinge = " type='revolute'><parent>l0</parent><child>";
  const ReadSdf read = read_world(model(
      "a",
      links(3) + "<joint name='p'" + hinge +
          "l1</child><axis><xyz>0 0 1</xyz></axis></joint><joint name='q'" + hinge +
          "l2</child><axis><xyz>0 0 1</xyz></axis></joint><joint name='g' type='gearbox'><parent>l1</parent>"
          "<child>l2</child><gearbox_ratio>3</gearbox_ratio><gearbox_reference_body>l0</"
          "gearbox_reference_body>"
          "</joint>"));
  const Joint& joint = *read.model("a").description->find_joint("q");
  EXPECT_EQ(joint.mimic->joint, "p");
  EXPECT_EQ(joint.mimic->multiplier, -3);
}

TEST(SdfJoint, ClosedLoopIsOpenedWithNote) {
  const auto joint = [](const char* name, const char* parent, const char* child) {
    return std::string("<joint name='") + name + "' type='revolute'><parent>" + parent + "</parent><child>" +
           child + "</child><axis><xyz>0 0 1</xyz></axis></joint>\n";
  };
  const ReadSdf read = read_world(
      model("a", links(3) + joint("a", "l0", "l1") + joint("b", "l1", "l2") + joint("c", "l2", "l0")));
  EXPECT_EQ(read.count("sdf.loop"), 1);
  EXPECT_EQ(read.model("a").description->links.size(), 4u);  // one joint frame: the axis of c is at l0
}

TEST(SdfJoint, JointWithoutRangeIsFixed) {
  const ReadSdf read = read_world(model(
      "a",
      links(2) +
          "<joint name='j' type='revolute'><parent>l0</parent><child>l1</child><axis><xyz>0 0 1</xyz><limit>"
          "<lower>0</lower><upper>0</upper></limit></axis></joint>"));
  EXPECT_EQ(read.model("a").description->find_joint("j")->type, JointType::fixed);
}

}  // namespace
}  // namespace doppel
