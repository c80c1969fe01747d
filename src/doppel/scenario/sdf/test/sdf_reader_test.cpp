// What the reader makes of worlds, models, frames and errors.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <numbers>

#include "doppel/scenario/sdf/test/sdf_fixture.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

using std::numbers::pi;

TEST(Sdf, WorldSettingsAreReadWithSmallerFriction) {
  const ReadSdf read = read_world(
      "<gravity>0 0 -1.6</gravity><physics type='ode'><max_step_size>0.002</max_step_size></physics>");
  EXPECT_EQ(read.world.settings.name, "w");
  EXPECT_EQ(read.world.settings.gravity, Eigen::Vector3d(0, 0, -1.6));
  EXPECT_EQ(read.world.settings.step, Duration(2'000'000));
  EXPECT_EQ(read.world.settings.friction_rule, FrictionRule::smaller);
  EXPECT_FALSE(read.world.settings.ground);
}

TEST(Sdf, PlaceOnEarthAndMagneticFieldAreRead) {
  const ReadSdf read = read_world(
      "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model><latitude_deg>47.5</latitude_deg>"
      "<longitude_deg>-8.25</longitude_deg><elevation>430</elevation><heading_deg>90</heading_deg>"
      "</spherical_coordinates><magnetic_field>1e-6 2e-6 -3e-6</magnetic_field>");
  EXPECT_TRUE(read.world.earth.is_given);
  EXPECT_EQ(read.world.earth.origin.latitude, 47.5);
  EXPECT_EQ(read.world.earth.origin.longitude, -8.25);
  EXPECT_EQ(read.world.earth.origin.altitude, 430);
  EXPECT_NEAR(read.world.earth.heading, pi / 2, 1e-12);
  EXPECT_EQ(read.world.earth.magnetic_field, Eigen::Vector3d(1e-6, 2e-6, -3e-6));
  EXPECT_FALSE(read_world("").world.earth.is_given);
  EXPECT_EQ(read_world("").world.earth.magnetic_field, Eigen::Vector3d(5.5645e-6, 22.8758e-6, -42.3884e-6));
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

TEST(Sdf, ModelNamedGroundIsRenamed) {
  const ReadSdf read = read_world(model("ground", std::string("<static>true</static>") + kBall) +
                                  model("ground_model", std::string("<static>true</static>") + kBall));
  EXPECT_EQ(read.world.find("ground"), nullptr);
  EXPECT_EQ(read.model("ground_model_1").base, BaseKind::fixed);
  EXPECT_EQ(read.count("sdf.renamed"), 1);
}

TEST(Sdf, RestitutionOfPlaneIsThatOfGround) {
  const ReadSdf read = read_world(model("floor",
                                        "<static>true</static><link name='l'><collision "
                                        "name='c'><geometry><plane><normal>0 0 1</normal></plane></geometry>"
                                        "<surface><bounce><restitution_coefficient>0.6</"
                                        "restitution_coefficient><threshold>0.1</threshold></bounce>"
                                        "</surface></collision></link>"));
  EXPECT_EQ(read.world.settings.ground_restitution, 0.6);
}

TEST(Sdf, RaisedPlaneStaysShape) {
  const ReadSdf read = read_world(model("p",
                                        "<static>1</static><pose>0 0 1 0 0 0</pose><link name='l'><collision "
                                        "name='c'><geometry><plane/></geometry>"
                                        "</collision></link>"));
  EXPECT_FALSE(read.world.settings.ground);
  EXPECT_EQ(read.model("p").description->links[0].collisions.size(), 1u);
}

TEST(Sdf, SensorWhoseSystemIsNotLoadedIsNotedOnce) {
  const std::string camera = "<sensor name='a' type='camera'/><sensor name='b' type='gpu_lidar'/>";
  const std::string with_camera = model("m", "<link name='l'>" + camera + "</link>");
  const std::string physics = "<plugin name='p' filename='gz-sim-physics-system'/>";
  EXPECT_EQ(read_world(physics + with_camera).count("sdf.sensor_system"), 1);
  EXPECT_EQ(read_world(with_camera).count("sdf.sensor_system"), 0);  // gz-sim's own list, or Gazebo classic
  EXPECT_EQ(read_world(physics + "<plugin name='s' filename='gz-sim-sensors-system'/>" + with_camera)
                .count("sdf.sensor_system"),
            0);
}

TEST(SdfPose, DegreesAndQuaternionsGiveRotations) {
  const ReadSdf read = read_world(
      model("a", std::string("<pose degrees='true'>0 0 0 0 0 90</pose>") + kBall) +
      model("b",
            std::string("<pose rotation_format='quat_xyzw'>0 0 0  0 0 0.7071067811865476 0.7071067811865476"
                        "</pose>") +
                kBall));
  for (const char* name : {"a", "b"})
    EXPECT_TRUE(read.model(name).X_WR.linear().isApprox(rotation_from_rpy({0, 0, pi / 2}), 1e-12)) << name;
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
  EXPECT_NEAR(read.model("a").positions[0].second, pi / 2, 1e-12);
}

TEST(SdfPose, NameOfModelItselfIsItsFrame) {
  const ReadSdf read = read_world(
      model("a", "<link name='l'/><frame name='f'><pose relative_to='a'>1 0 0 0 0 0</pose></frame>"));
  EXPECT_EQ(read.count("sdf.own_frame"), 1);
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

}  // namespace
}  // namespace doppel
