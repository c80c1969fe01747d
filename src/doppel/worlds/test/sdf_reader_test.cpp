// What the reader makes of each feature of SDF.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <numbers>

#include "doppel/worlds/test/sdf_fixture.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

const char* const kBall =
    "<link name='link'><inertial><mass>2</mass><inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia>"
    "</inertial><collision "
    "name='c'><geometry><sphere><radius>0.5</radius></sphere></geometry></collision></link>";

std::string model(const std::string& name, const std::string& content) {
  return "<model name='" + name + "'>" + content + "</model>\n";
}

std::string links(int count) {
  std::string out;
  for (int i = 0; i < count; ++i) {
    out += "<link name='l" + std::to_string(i) + "'><pose>" + std::to_string(i) +
           " 0 0 0 0 0</pose><inertial><mass>1</mass></inertial></link>";
  }
  return out;
}

TEST(Sdf, WorldSettingsAreReadWithSmallerFriction) {
  const ReadSdf read = read_world(
      "<gravity>0 0 -1.6</gravity><physics type='ode'><max_step_size>0.002</max_step_size></physics>");
  EXPECT_EQ(read.world.settings.name, "w");
  EXPECT_EQ(read.world.settings.gravity, Eigen::Vector3d(0, 0, -1.6));
  EXPECT_EQ(read.world.settings.step, Duration(2'000'000));
  EXPECT_EQ(read.world.settings.friction_rule, FrictionRule::smaller);
  EXPECT_FALSE(read.world.settings.ground);
}

TEST(Sdf, FreeModelFloatsAndStaticOneIsFixed) {
  const ReadSdf read = read_world(model("a", std::string("<pose>1 2 3 0 0 0</pose>") + kBall) +
                                  model("b", std::string("<static>true</static>") + kBall));
  EXPECT_EQ(read.model("a").base, BaseKind::floating);
  EXPECT_EQ(read.model("a").X_WR.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read.model("b").base, BaseKind::fixed);
  EXPECT_FALSE(read.model("b").description->links[0].inertial);
  const Inertial& body = *read.model("a").description->links[0].inertial;
  EXPECT_EQ(body.mass, 2);
  EXPECT_EQ(body.iyy, 0.2);
}

TEST(Sdf, PlaneAtZeroBecomesGround) {
  const ReadSdf read = read_world("<include><uri>model://ground_plane</uri></include>");
  EXPECT_TRUE(read.world.settings.ground);
  EXPECT_EQ(read.world.settings.ground_friction, 100);
  EXPECT_TRUE(read.model("ground_plane").description->links[0].collisions.empty());
  EXPECT_EQ(read.count("sdf.built_in"), 1);
}

TEST(Sdf, RaisedPlaneStaysShape) {
  const ReadSdf read = read_world(model("p",
                                        "<static>1</static><pose>0 0 1 0 0 0</pose><link name='l'><collision "
                                        "name='c'><geometry><plane/></geometry>"
                                        "</collision></link>"));
  EXPECT_FALSE(read.world.settings.ground);
  EXPECT_EQ(read.model("p").description->links[0].collisions.size(), 1u);
}

TEST(SdfPose, DegreesAndQuaternionsGiveRotations) {
  const ReadSdf read = read_world(
      model("a", std::string("<pose degrees='true'>0 0 0 0 0 90</pose>") + kBall) +
      model("b",
            std::string("<pose rotation_format='quat_xyzw'>0 0 0  0 0 0.7071067811865476 0.7071067811865476"
                        "</pose>") +
                kBall));
  for (const char* name : {"a", "b"})
    EXPECT_TRUE(read.model(name).X_WR.linear().isApprox(rotation_from_rpy({0, 0, kPi / 2}), 1e-12)) << name;
}

TEST(SdfPose, FramesOfModelAndWorldAreResolved) {
  const ReadSdf read =
      read_world("<frame name='f'><pose>0 0 1 0 0 1.5707963267948966</pose></frame>\n" +
                 model("a", std::string("<pose relative_to='f'>1 0 0 0 0 0</pose>") + kBall) +
                 model("b", std::string("<pose relative_to='a::link'>1 0 0 0 0 0</pose>") + kBall));
  EXPECT_TRUE(read.model("a").X_WR.translation().isApprox(Eigen::Vector3d(0, 1, 1), 1e-12));
  EXPECT_TRUE(read.model("b").X_WR.translation().isApprox(Eigen::Vector3d(0, 2, 1), 1e-12));
}

TEST(SdfPose, PlacementFrameIsPutAtPose) {
  const ReadSdf read = read_world(model(
      "a",
      std::string("<pose>0 0 5 0 0 0</pose><frame name='foot'><pose>0 0 -1 0 0 0</pose></frame>") + kBall));
  EXPECT_EQ(read.model("a").X_WR.translation(), Eigen::Vector3d(0, 0, 5));
  const ReadSdf placed = read_world(
      "<model name='a' placement_frame='foot'><pose>0 0 5 0 0 0</pose><frame name='foot'><pose>0 0 -1 0 0 "
      "0</pose>"
      "</frame>" +
      std::string(kBall) + "</model>");
  EXPECT_EQ(placed.model("a").X_WR.translation(), Eigen::Vector3d(0, 0, 6));
}

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
  EXPECT_NEAR(slide.mimic->multiplier, 0.01 / (2 * kPi), 1e-15);
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

TEST(SdfModel, LinksWithoutJointsAreSeparateModels) {
  const ReadSdf read = read_world(model("a", links(2)));
  EXPECT_EQ(read.model("a").description->links.size(), 1u);
  EXPECT_EQ(read.model("a::l1").X_WR.translation(), Eigen::Vector3d(1, 0, 0));
}

TEST(SdfModel, LinksOfStaticModelAreOneTree) {
  const ReadSdf read = read_world(model("a", "<static>true</static>" + links(3)));
  EXPECT_EQ(read.world.models.size(), 1u);
  EXPECT_EQ(link_pose(read.model("a"), "l2").translation(), Eigen::Vector3d(2, 0, 0));
}

TEST(SdfModel, NestedLinksHaveScopedNames) {
  const ReadSdf read = read_world(model(
      "outer",
      links(1) + "<model name='inner'><pose>0 0 1 0 0 0</pose>" + kBall +
          "</model><joint name='j' type='fixed'><parent>l0</parent><child>inner::link</child></joint>"));
  EXPECT_NE(read.model("outer").description->find_link("inner::link"), nullptr);
  EXPECT_EQ(link_pose(read.model("outer"), "inner::link").translation(), Eigen::Vector3d(0, 0, 1));
}

TEST(SdfModel, JointOfWorldConnectsModels) {
  const ReadSdf read =
      read_world(model("a", kBall) + model("b", std::string("<pose>0 0 2 0 0 0</pose>") + kBall) +
                 "<joint name='j' type='revolute'><parent>a::link</parent><child>b::link</child><axis><xyz>0 "
                 "1 0</xyz></axis></joint>");
  EXPECT_EQ(read.world.models.size(), 1u);
  EXPECT_EQ(link_pose(read.model("a"), "b::link").translation(), Eigen::Vector3d(0, 0, 2));
}

TEST(SdfShape, EveryGeometryIsRead) {
  const auto shape = [](const std::string& xml) {
    return read_world(model("a", "<link name='l'><collision name='c'><geometry>" + xml +
                                     "</geometry></collision></link>"))
        .model("a")
        .description->links[0]
        .collisions;
  };
  EXPECT_EQ(std::get<Box>(shape("<box><size>1 2 3</size></box>")[0].geometry).size.z(), 3);
  EXPECT_EQ(
      std::get<Capsule>(shape("<capsule><radius>1</radius><length>2</length></capsule>")[0].geometry).length,
      2);
  EXPECT_EQ(std::get<Ellipsoid>(shape("<ellipsoid><radii>1 2 3</radii></ellipsoid>")[0].geometry).radii.y(),
            2);
  EXPECT_EQ(std::get<Cone>(shape("<cone><radius>1</radius><length>2</length></cone>")[0].geometry).length, 2);
  EXPECT_EQ(std::get<Plane>(shape("<plane><normal>0 1 0</normal></plane>")[0].geometry).normal.y(), 1);
  const std::string arrow =
      "<polyline><point>0 0</point><point>2 0</point><point>1 0.5</point><point>2 2</point><point>0 2</point>"
      "<height>0.3</height></polyline>";
  EXPECT_EQ(shape(arrow).size(), 2u);  // not convex at (1, 0.5)
  EXPECT_TRUE(shape("<empty/>").empty());
}

TEST(SdfShape, SurfaceIsReadAsWritten) {
  const ReadSdf read = read_world(model(
      "a",
      "<link name='l'><collision name='c'><geometry><box><size>1 1 "
      "1</size></box></geometry><surface><friction>"
      "<ode><mu>0.3</mu><mu2>0.2</mu2><fdir1>1 0 "
      "0</fdir1><slip1>0.1</slip1></ode><torsional><coefficient>0.05"
      "</coefficient><patch_radius>0.02</patch_radius></torsional></"
      "friction><bounce><restitution_coefficient>0.4"
      "</restitution_coefficient></bounce><contact><ode><kp>1e5</kp><kd>10</kd><max_vel>0.1</"
      "max_vel><min_depth>"
      "0.001</min_depth></ode></contact></surface></collision><collision name='d'><geometry><box><size>1 1 1"
      "</size></box></geometry></collision></link>"));
  const auto& collisions = read.model("a").description->links[0].collisions;
  const ContactSurface& surface = collisions[0].surface;
  EXPECT_EQ(surface.mu, 0.3);
  EXPECT_EQ(surface.mu2, 0.2);
  EXPECT_EQ(surface.fdir1, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(surface.slip1, 0.1);
  EXPECT_EQ(surface.torsional_mu, 0.05);
  EXPECT_EQ(surface.patch_radius, 0.02);
  EXPECT_EQ(surface.restitution, 0.4);
  EXPECT_EQ(surface.kp, 1e5);
  EXPECT_EQ(surface.max_velocity, 0.1);
  EXPECT_EQ(surface.min_depth, 0.001);
  EXPECT_EQ(collisions[1].surface.mu, 1.0);  // SDF's default
}

TEST(SdfShape, MaterialsGiveColours) {
  const auto colour = [](const std::string& material) {
    return *read_world(model("a",
                             "<link name='l'><visual name='v'><geometry><sphere><radius>1</radius></sphere>"
                             "</geometry><material>" +
                                 material + "</material></visual></link>"))
                .model("a")
                .description->links[0]
                .visuals[0]
                .material->rgba;
  };
  EXPECT_EQ(colour("<diffuse>0.1 0.2 0.3</diffuse>"), Eigen::Vector4d(0.1, 0.2, 0.3, 1));
  EXPECT_EQ(colour("<script><name>Gazebo/Orange</name></script>"), Eigen::Vector4d(1, 0.509, 0.047, 1));
  EXPECT_EQ(colour("<script>Gazebo/Blue</script>"), Eigen::Vector4d(0, 0, 1, 1));
}

TEST(SdfInertial, AutoInertiaFollowsFromCollisionDensities) {
  const ReadSdf read =
      read_world(model("a",
                       "<link name='l'><inertial auto='true'><density>2000</density></inertial><collision "
                       "name='c'><pose>1 0 0 0 0 0"
                       "</pose><geometry><box><size>0.1 0.2 0.3</size></box></geometry></collision></link>"));
  const Inertial& body = *read.model("a").description->links[0].inertial;
  EXPECT_NEAR(body.mass, 12.0, 1e-12);
  EXPECT_NEAR(body.origin.xyz.x(), 1.0, 1e-12);
  EXPECT_NEAR(body.ixx, 12.0 / 12 * (0.04 + 0.09), 1e-12);
}

TEST(SdfState, SavedPosesReplaceThoseOfModels) {
  const ReadSdf read = read_world(
      model(
          "a",
          links(2) +
              "<joint name='j' type='revolute'><pose>-1 0 0 0 0 0</pose><parent>l0</parent><child>l1</child>"
              "<axis><xyz>0 0 1</xyz></axis></joint>") +
      "<state world_name='w'><model name='a'><pose>5 0 0 0 0 0</pose><link name='l0'><pose>5 0 0 0 0 "
      "0</pose></link>"
      "<link name='l1'><pose>5 1 0 0 0 1.5707963267948966</pose></link></model></state>");
  EXPECT_EQ(read.model("a").X_WR.translation(), Eigen::Vector3d(5, 0, 0));
  ASSERT_EQ(read.model("a").positions.size(), 1u);
  EXPECT_NEAR(read.model("a").positions[0].second, kPi / 2, 1e-12);
}

TEST(SdfJoint, JointWithoutRangeIsFixed) {
  const ReadSdf read = read_world(model(
      "a",
      links(2) +
          "<joint name='j' type='revolute'><parent>l0</parent><child>l1</child><axis><xyz>0 0 1</xyz><limit>"
          "<lower>0</lower><upper>0</upper></limit></axis></joint>"));
  EXPECT_EQ(read.model("a").description->find_joint("j")->type, JointType::fixed);
}

TEST(SdfPose, NameOfModelItselfIsItsFrame) {
  const ReadSdf read = read_world(
      model("a", "<link name='l'/><frame name='f'><pose relative_to='a'>1 0 0 0 0 0</pose></frame>"));
  EXPECT_EQ(read.count("sdf.own_frame"), 1);
}

TEST(SdfInclude, JointToPartOfMissingModelIsToItsStandIn) {
  const ReadSdf read = read_world(model(
      "a",
      "<link name='l'/><include><uri>model://arm</uri><name>arm</name></include><joint name='j' type='fixed'>"
      "<parent>l</parent><child>arm::wrist</child></joint>"));
  EXPECT_NE(read.model("a").description->find_link("arm::link"), nullptr);
  const ReadSdf unnamed =
      read_world(model("a",
                       "<link name='l'/><include><uri>model://arm_v2</uri></include><joint name='j' "
                       "type='fixed'><parent>l</parent>"
                       "<child>arm::wrist</child></joint>"));
  EXPECT_EQ(unnamed.count("sdf.missing_part"), 1);
}

TEST(SdfLight, LightHasDirectionAndColour) {
  const ReadSdf read = read_world(
      "<light type='directional' name='sun'><diffuse>1 0.5 0 1</diffuse><direction>0 3 "
      "0</direction></light>");
  ASSERT_EQ(read.world.lights.size(), 1u);
  EXPECT_EQ(read.world.lights[0].kind, SdfLightKind::directional);
  EXPECT_EQ(read.world.lights[0].direction_W, Eigen::Vector3d::UnitY());
}

TEST(SdfNotes, UnknownElementIsNotedWithNearestName) {
  const ReadSdf read = read_world(model("a", "<link name='l'>\n<colision name='c'/></link>"));
  const std::string message = read.message("sdf.unknown_element");
  EXPECT_THAT(message, HasSubstr("test.sdf:3:"));
  EXPECT_THAT(message, HasSubstr("'collision'"));
}

TEST(SdfNotes, ElementWithoutEffectIsNotedOnce) {
  const ReadSdf read = read_world("<gui/><audio/><gui/>");
  EXPECT_EQ(read.count("sdf.no_effect"), 2);
}

TEST(SdfNotes, ForeignElementsAndUndeclaredPrefixesAreTolerated) {
  const ReadSdf read = read_world(model("a", std::string("<drake:hint/>") + kBall));
  EXPECT_EQ(read.count("sdf.unknown_element"), 0);
  const ReadSdf prefixed = read_world(model(
      "a",
      "<link name='l'><collision name='c'><geometry><box><size>1 1 "
      "1</size></box></geometry><surface><friction><ode>"
      "<fdir1 gz:expressed_in='__model__'>1 0 0</fdir1></ode></friction></surface></collision></link>"));
  EXPECT_EQ(prefixed.model("a").description->links[0].collisions[0].surface.fdir1, Eigen::Vector3d::UnitX());
}

TEST(SdfInclude, MissingModelGivesStandInAndOneMessage) {
  const ReadSdf read = read_world(
      "<include><uri>model://chair</uri></include><include><uri>model://chair</uri><name>other</name>"
      "<pose>1 0 0 0 0 0</pose></include>");
  EXPECT_EQ(read.count("sdf.missing_model"), 1);
  EXPECT_EQ(read.model("other").X_WR.translation(), Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(read.model("chair").description->links[0].visuals.size(), 1u);
  EXPECT_TRUE(read.model("chair").description->links[0].collisions.empty());
  EXPECT_EQ(read.world.missing, std::vector<std::string>{"model://chair"});
}

// W4
TEST(SdfErrors, CircleOfPosesGivesOneError) {
  const auto errors = errors_of(
      "<sdf version='1.9'><world name='w'>\n<model name='a'>\n<link name='l'>\n<pose "
      "relative_to='f'/></link>\n"
      "<frame name='f'>\n<pose relative_to='l'/></frame></model></world></sdf>");
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].rule, "sdf.frame_cycle");
  EXPECT_EQ(errors[0].where.line, 4);
}

TEST(SdfErrors, DuplicateNameGivesOneErrorAtSecond) {
  const auto errors = errors_of(
      "<sdf version='1.9'><world name='w'>\n<model name='a'><link name='l'/></model>\n<model name='a'><link "
      "name='l'/>"
      "</model></world></sdf>");
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].rule, "sdf.duplicate_name");
  EXPECT_EQ(errors[0].where.line, 3);
}

TEST(SdfErrors, UnknownFrameGivesOneErrorWithNearestName) {
  const auto errors = errors_of(
      "<sdf version='1.9'><world name='w'>\n<model name='a'><link name='wheel'/><link name='b'>\n"
      "<pose relative_to='wheell'/></link></model></world></sdf>");
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].rule, "sdf.unknown_frame");
  EXPECT_EQ(errors[0].where.line, 3);
  EXPECT_THAT(errors[0].message, HasSubstr("wheel"));
}

TEST(SdfErrors, JointToUnknownLinkGivesOneError) {
  const auto errors = errors_of(
      "<sdf version='1.9'><model name='a'><link name='l'/>\n<joint name='j' type='fixed'><parent>l</parent>"
      "<child>x</child></joint></model></sdf>");
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].where.line, 2);
}

// What a client could send to end the process.
TEST(SdfErrors, EndlessChainsAreRefused) {
  std::string frames, chain, outline;
  for (int i = 1; i < 3000; ++i) {
    frames += fmt::format("<frame name='f{}'><pose relative_to='f{}'/></frame>", i, i + 1);
    chain += fmt::format(
        "<link name='l{0}'/><joint name='j{0}' type='fixed'><parent>l{1}</parent><child>l{0}</child></joint>",
        i, i - 1);
    outline += fmt::format("<point>{} {}</point>", i, i % 2);
  }
  const auto refused = [](const std::string& content) {
    const auto errors =
        errors_of("<sdf version='1.9'><model name='m'><link name='l0'/>" + content + "</model></sdf>");
    return errors.empty() ? "" : errors.front().rule;
  };
  EXPECT_EQ(refused(frames), "sdf.too_deep");
  EXPECT_EQ(refused(chain), "sdf.too_deep");
  EXPECT_EQ(refused("<link name='a'><visual name='v'><geometry><polyline>" + outline +
                    "</polyline></geometry></visual></link>"),
            "sdf.value");
}

class SdfFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / "doppel_sdf";
    std::filesystem::remove_all(folder_);
  }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  ReadSdf load(const std::string& name) const {
    ReadSdf out;
    PackageResolver resolver;
    out.world = load_sdf(folder_ / name, resolver, out.notes);
    return out;
  }
  std::filesystem::path folder_;
};

TEST_F(SdfFiles, IncludeBesideWorldIsReadInNewestVersion) {
  write("models/can/model.config",
        "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.10'>new.sdf</sdf><sdf "
        "version='1.9'>mid.sdf</sdf></model>");
  for (const char* name : {"old", "mid", "new"})
    write(std::string("models/can/") + name + ".sdf",
          std::string("<sdf version='1.9'><model name='") + name + "'>" + kBall + "</model></sdf>");
  write("worlds/w.sdf",
        "<sdf version='1.9'><world name='w'><include><uri>model://can</uri><pose>1 0 0 0 0 0</pose></include>"
        "<include><name>second</name><uri>model://can</uri><static>true</static></include></world></sdf>");
  write("package.xml", "<package><name>p</name></package>");
  const ReadSdf read = load("worlds/w.sdf");
  EXPECT_EQ(read.model("new").X_WR.translation(), Eigen::Vector3d(1, 0, 0));
  EXPECT_TRUE(read.model("second").is_static);
  EXPECT_EQ(read.world.files.size(), 2u);
}

TEST_F(SdfFiles, MergedModelPartsBelongToIncluder) {
  write("wheel/model.sdf",
        "<sdf version='1.9'><model name='wheel'><link name='rim'><pose>0 0 1 0 0 0</pose></link><joint "
        "name='axle' "
        "type='fixed'><parent>__model__</parent><child>hub</child></joint><link name='hub'><pose>0 0 2 0 0 "
        "0</pose></link>"
        "</model></sdf>");
  write("car.sdf",
        "<sdf version='1.9'><model name='car'><link name='body'/><include merge='true'><uri>wheel</uri>"
        "<pose>1 0 0 0 0 0</pose></include><joint name='j' "
        "type='fixed'><parent>body</parent><child>rim</child></joint>"
        "</model></sdf>");
  const ReadSdf read = load("car.sdf");
  EXPECT_EQ(link_pose(read.model("car"), "rim").translation(), Eigen::Vector3d(1, 0, 1));
  EXPECT_EQ(link_pose(read.model("car"), "hub").translation(), Eigen::Vector3d(1, 0, 2));
}

TEST_F(SdfFiles, FileIncludingItselfIsRefused) {
  write("a/model.sdf",
        "<sdf version='1.9'><model name='a'><include><uri>model://a</uri></include></model></sdf>");
  write("w.sdf", "<sdf version='1.9'><world name='w'><include><uri>model://a</uri></include></world></sdf>");
  EXPECT_THROW(load("w.sdf"), InputError);
}

TEST(SdfModels, ModelAroundStaticOneIsStatic) {
  const std::string wall = "<model name='wall'><static>true</static><link name='l'/></model>";
  const ReadSdf read =
      read_sdf("<sdf version='1.6'><world name='w'><model name='around'>" + wall +
               "</model><model name='beside'>" + wall + "<link name='free'/></model></world></sdf>");
  EXPECT_TRUE(read.model("around").is_static);
  EXPECT_EQ(read.model("around").base, BaseKind::fixed);
  EXPECT_FALSE(read.model("beside").is_static);
  EXPECT_THAT(read.message("sdf.no_effect"), ::testing::HasSubstr("<static> of a nested model"));
}

TEST_F(SdfFiles, XacroIsExpandedAndKeepsItsPlaces) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "arena.sdf.xacro";
  std::ofstream(file)
      << "<sdf version='1.9' xmlns:xacro='http://www.ros.org/wiki/xacro'>\n"
         "<xacro:arg name='x' default='2'/><xacro:property name='twice' value='${2 * $(arg x)}'/>\n"
         "<world name='arena'><model name='m'><pose>${twice} 0 0 0 0 0</pose>\n"
         "<link name='l'><colision/></link></model></world></sdf>";
  EXPECT_TRUE(is_sdf(file));
  EXPECT_FALSE(is_sdf("arm.urdf.xacro"));
  PackageResolver resolver;
  Diagnostics found;
  const SdfWorld world = load_sdf(file, resolver, found);
  EXPECT_EQ(world.settings.name, "arena");
  EXPECT_DOUBLE_EQ(world.models.at(0).X_WR.translation().x(), 4);
  EXPECT_TRUE(std::ranges::any_of(found.all(), [](const Diagnostic& one) {
    return one.rule == "sdf.unknown_element" && one.where.line == 4;
  }));
}

std::string population(const std::string& how) {
  return "<sdf version='1.9'><world name='w'><population name='cans'><pose>1 2 3 0 0 0</pose>"
         "<model name='can'><pose>9 9 9 0 0 0.5</pose><static>true</static><link name='l'/></model>" +
         how + "</population></world></sdf>";
}

TEST(SdfPopulation, GridIsCentredAtItsPose) {
  const ReadSdf read = read_sdf(population(
      "<distribution><type>grid</type><rows>2</rows><cols>3</cols><step>0.4 1 0</step></distribution>"));
  ASSERT_EQ(read.world.models.size(), 6u);
  const Pose first = read.model("cans_clone_0").X_WR;
  EXPECT_TRUE(first.translation().isApprox(Eigen::Vector3d(0.6, 1.5, 3)));
  EXPECT_NEAR(rpy_from_rotation(first.linear()).z(), 0.5, 1e-12);
  EXPECT_TRUE(read.model("cans_clone_5").X_WR.translation().isApprox(Eigen::Vector3d(1.4, 2.5, 3)));
  EXPECT_TRUE(read.model("cans_clone_5").is_static);
}

TEST(SdfPopulation, RandomCopiesAreInRegionAndRepeatable) {
  for (const char* type : {"random", "uniform"}) {
    const std::string text = population(
        "<model_count>40</model_count><cylinder><radius>2</radius><length>1"
        "</length></cylinder><distribution><type>" +
        std::string(type) + "</type></distribution>");
    const ReadSdf read = read_sdf(text), again = read_sdf(text);
    ASSERT_EQ(read.world.models.size(), 40u);
    for (std::size_t i = 0; i < 40; ++i) {
      const Eigen::Vector3d p = read.world.models[i].X_WR.translation() - Eigen::Vector3d(1, 2, 3);
      EXPECT_LE(p.head<2>().norm(), 2.0);
      EXPECT_LE(std::abs(p.z()), 0.5);
      EXPECT_EQ(p, again.world.models[i].X_WR.translation() - Eigen::Vector3d(1, 2, 3));
    }
  }
}

TEST(SdfPopulation, LineEndsOnSidesOfRegion) {
  const ReadSdf read =
      read_sdf(population("<model_count>3</model_count><box><size>4 1 1</size></box>"
                          "<distribution><type>linear-x</type></distribution>"));
  ASSERT_EQ(read.world.models.size(), 3u);
  EXPECT_TRUE(read.model("cans_clone_0").X_WR.translation().isApprox(Eigen::Vector3d(-1, 2, 3)));
  EXPECT_TRUE(read.model("cans_clone_1").X_WR.translation().isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(SdfPopulation, UnknownDistributionAndCountAreErrors) {
  EXPECT_THROW(read_sdf(population("<distribution><type>gird</type></distribution>")), InputError);
  EXPECT_THROW(read_sdf(population("<model_count>-1</model_count>")), InputError);
}

TEST(SdfPopulation, GridWithInvalidOrTooManyPlacesIsError) {
  const auto refusal = [](const std::string& sizes) -> std::string {
    try {
      read_sdf(population("<distribution><type>grid</type>" + sizes + "</distribution>"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("<rows>0</rows>"),
              ::testing::HasSubstr("<rows> is 0; it must be a whole number from 1 to 10000"));
  EXPECT_THAT(refusal("<cols>2.5</cols>"), ::testing::HasSubstr("<cols> is 2.5"));
  EXPECT_THAT(refusal("<rows>-3</rows><cols>20000</cols>"), ::testing::HasSubstr("<cols> is 20000"));
  EXPECT_THAT(refusal("<rows>200</rows><cols>51</cols>"), ::testing::HasSubstr("200 x 51 places"));
}

}  // namespace
}  // namespace doppel
