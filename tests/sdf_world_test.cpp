// SDF worlds in the twin: models as objects, with and without robots.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/visualization_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using ::testing::HasSubstr;
using visualization_msgs::msg::MarkerArray;

// A cabinet with a door and two shelves that are loose, and a static wall of two links.
constexpr const char* kRoom = R"(<sdf version='1.9'><world name='room'>
<gravity>0 0 -9.81</gravity>
<include><uri>model://ground_plane</uri></include>
<model name='cabinet'><pose>3 0 0.5 0 0 0</pose>
  <link name='body'><inertial><mass>20</mass></inertial>
    <collision name='c'><geometry><box><size>0.4 0.6 1</size></box></geometry></collision>
    <visual name='v'><geometry><box><size>0.4 0.6 1</size></box></geometry></visual></link>
  <link name='door'><pose>-0.25 0 0 0 0 0</pose><inertial><mass>2</mass></inertial>
    <collision name='c'><geometry><box><size>0.02 0.5 0.9</size></box></geometry></collision>
    <visual name='v'><geometry><box><size>0.02 0.5 0.9</size></box></geometry></visual>
    <visual name='knob'><pose>-0.03 -0.2 0 0 0 0</pose><geometry><cone><radius>0.02</radius><length>0.04</length></cone>
      </geometry></visual></link>
  <joint name='hinge' type='revolute'><pose>0 0.25 0 0 0 0</pose><parent>body</parent><child>door</child>
    <axis><xyz>0 0 -1</xyz><limit><lower>0</lower><upper>1.6</upper></limit></axis></joint>
</model>
<model name='ball'><pose>3 2 0.5 0 0 0</pose><link name='l'><inertial><mass>1</mass></inertial>
  <collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model>
<model name='wall'><static>true</static>
  <link name='a'><pose>5 0 1 0 0 0</pose><collision name='c'><geometry><box><size>0.1 2 2</size></box></geometry>
    </collision></link>
  <link name='b'><pose>5 2 1 0 0 0</pose><collision name='c'><geometry><box><size>0.1 2 2</size></box></geometry>
    </collision></link></model>
</world></sdf>)";

class SdfWorldTest : public TwinFixture {
 protected:
  void SetUp() override {
    folder_ = make_folder("sdf_world");
    write(kRoom);
  }
  void write(const std::string& text) const { std::ofstream(folder_ / "room.sdf") << text; }
  void start(const std::string& robot) {
    Scenario scenario;
    if (!robot.empty()) scenario.robots = {{.target = robot}};
    scenario.world = folder_ / "room.sdf";
    bring_up(scenario);
  }
  Instance find(const std::string& name) {
    const std::optional<Instance> found = twin_->engine().find(name);
    EXPECT_TRUE(found) << name;
    return *found;
  }
  std::string state_of(const std::string& name) {
    return call("/gazebo/get_entity_state", "gazebo_msgs/srv/GetEntityState", "{name: '" + name + "'}");
  }
  std::filesystem::path folder_;
};

TEST_F(SdfWorldTest, ModelsStandAndFallWithoutRobot) {
  start("");
  EXPECT_EQ(twin_->name(), "room");
  EXPECT_TRUE(twin_->robots().empty());
  run(1.0);
  EXPECT_NEAR(find("ball").base_pose().translation().z(), 0.1, 2e-3);
  EXPECT_NEAR(find("cabinet").base_pose().translation().z(), 0.5, 2e-3);
  EXPECT_FALSE(twin_->diverged());
}

TEST_F(SdfWorldTest, RobotsControllersRunInIt) {
  start("lab_arm");
  run(0.3);
  EXPECT_EQ(twin_->robots().size(), 1u);
  EXPECT_THAT(state_of("cabinet::door"), HasSubstr("success: true"));
  EXPECT_THAT(state_of("wall::b"), HasSubstr("success: true"));
  EXPECT_THAT(state_of("cabinet::dor"), HasSubstr("success: false"));
}

TEST_F(SdfWorldTest, DoorTurnsAboutItsHinge) {
  start("");
  listen("/doppel/objects");
  EXPECT_THAT(call("/gazebo/apply_link_wrench", "gazebo_msgs/srv/ApplyLinkWrench",
                   "{link_name: 'cabinet::door', reference_point: {y: -0.2}, wrench: {force: {x: -2}}, "
                   "duration: {sec: 1}}"),
              HasSubstr("success: true"));
  run(1.0);
  const Instance cabinet = find("cabinet");
  const int hinge = cabinet.model().find_joint("hinge");
  const double q =
      cabinet.q()[static_cast<std::size_t>(cabinet.model().joints[static_cast<std::size_t>(hinge)].q)];
  EXPECT_GT(q, 0.2);
  EXPECT_LT(q, 1.7);
}

TEST_F(SdfWorldTest, EveryVisualHasMarker) {
  start("");
  listen("/doppel/objects");
  run(0.05);
  const auto messages = received<MarkerArray>("/doppel/objects");
  ASSERT_FALSE(messages.empty());
  int cabinet = 0, wall = 0;
  bool triangles = false;
  for (const auto& marker : messages.back().markers) {
    cabinet += marker.text == "cabinet";
    wall += marker.text == "wall";
    triangles = triangles ||
                (marker.type == visualization_msgs::msg::Marker::TRIANGLE_LIST && !marker.points.empty());
  }
  EXPECT_EQ(cabinet, 3);
  EXPECT_EQ(wall, 2) << "expected the collisions of a model without visuals to be drawn";
  EXPECT_TRUE(triangles);
}

TEST_F(SdfWorldTest, TextureOfMaterialIsInMarker) {
  std::ofstream(folder_ / "wall.png") << "png";
  const std::string look = "<material><pbr><metal><albedo_map>wall.png</albedo_map></metal></pbr></material>";
  const std::string mesh = "<mesh><uri>file:///nowhere/none.dae</uri></mesh>";
  write(
      "<sdf version='1.9'><world name='w'><model name='m'><static>true</static><link name='l'>"
      "<visual name='box'><geometry><box/></geometry>" +
      look + "</visual><visual name='cone'><geometry><cone/></geometry>" + look +
      "</visual><visual name='lost'><geometry>" + mesh + "</geometry></visual></link></model></world></sdf>");
  start("");
  listen("/doppel/objects");
  run(0.05);
  const auto messages = received<MarkerArray>("/doppel/objects");
  ASSERT_FALSE(messages.empty());
  const auto& markers = messages.back().markers;
  ASSERT_EQ(markers.size(), 3u);
  EXPECT_EQ(markers[0].texture_resource, "file://" + (folder_ / "wall.png").string());
  EXPECT_EQ(markers[1].texture_resource, markers[0].texture_resource);
  EXPECT_EQ(markers[1].uv_coordinates.size(), markers[1].points.size()) << "expected where the texture lies";
  EXPECT_EQ(markers[2].type, visualization_msgs::msg::Marker::TRIANGLE_LIST);
  EXPECT_TRUE(markers[2].points.empty()) << "a mesh that is not found";
}

TEST_F(SdfWorldTest, LightsSurroundingsAndPhysicalMaterialsArePublished) {
  write(
      "<sdf version='1.9'><world name='w'><scene><ambient>0.1 0.2 0.3 "
      "1</ambient><sky><time>19</time></sky></scene>"
      "<light type='spot' name='lamp'><pose>1 2 3 0 0 0</pose><direction>0 1 0</direction><diffuse>1 0 0 "
      "1</diffuse>"
      "<attenuation><range>7</range></attenuation><spot><outer_angle>0.8</outer_angle></spot></light>"
      "<light type='point' name='off'><light_on>false</light_on></light>"
      "<model name='m'><static>true</static><link name='l'><visual "
      "name='a'><geometry><box/></geometry></visual>"
      "<visual name='b'><geometry><box/></geometry><material><emissive>0 1 0 1</emissive><pbr><metal>"
      "<metalness>0.9</metalness></metal></pbr></material></visual></link></model></world></sdf>");
  start("");
  listen("/doppel/scene");
  run(0.05);
  const auto scenes = received<doppel_msgs::msg::Scene>("/doppel/scene");
  ASSERT_EQ(scenes.size(), 1u);
  const doppel_msgs::msg::Scene& scene = scenes.front();
  EXPECT_TRUE(scene.has_environment && scene.sky);
  EXPECT_FLOAT_EQ(scene.ambient.b, 0.3F);
  EXPECT_EQ(scene.time, 19);
  ASSERT_EQ(scene.lights.size(), 1u) << "expected the light that is on";
  EXPECT_EQ(scene.lights[0].kind, doppel_msgs::msg::Light::SPOT);
  EXPECT_EQ(scene.lights[0].position.z, 3);
  EXPECT_EQ(scene.lights[0].direction.y, 1);
  EXPECT_EQ(scene.lights[0].range, 7);
  EXPECT_EQ(scene.lights[0].outer_angle, 0.8);
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.materials[0].marker, 1) << "expected the second marker's id";
  EXPECT_EQ(scene.materials[0].metalness, 0.9);
  EXPECT_LT(scene.materials[0].roughness, 0) << "expected a value that is not written";
  EXPECT_EQ(scene.materials[0].emissive.g, 1);
}

TEST_F(SdfWorldTest, ModelIsMovedAndDeletedAsWhole) {
  start("");
  EXPECT_THAT(call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
                   "{state: {name: cabinet, pose: {position: {x: 1, y: 1, z: 0.5}}}}"),
              HasSubstr("success: true"));
  const Instance cabinet = find("cabinet");
  EXPECT_NEAR(cabinet.base_pose().translation().y(), 1, 1e-9);
  const Pose X_WD = cabinet.link_pose(cabinet.model().find_link("door"));
  EXPECT_TRUE(X_WD.translation().isApprox(Eigen::Vector3d(0.75, 1, 0.5), 1e-9))
      << X_WD.translation().transpose();
  EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: cabinet}"),
              HasSubstr("success: true"));
  EXPECT_FALSE(twin_->engine().find("cabinet"));
}

TEST_F(SdfWorldTest, EditedWorldIsReloaded) {
  start("lab_arm");
  EXPECT_THAT(twin_->files(), ::testing::Contains(folder_ / "room.sdf"));
  run(0.8);
  std::string edited = kRoom;
  edited.replace(edited.find("<mass>1</mass>"), 14, "<mass>3</mass>");
  write(edited);
  Diagnostics found;
  twin_->replace(Twin::prepare(twin_->running(), found));
  EXPECT_EQ(find("ball").model().total_mass, 3);
  EXPECT_NEAR(find("ball").base_pose().translation().z(), 0.1, 2e-3) << "expected it where it had fallen";
}

// A cube of mu 0.3 on Gazebo's ground of mu 100, on slopes just below and above 0.3.
TEST_F(SdfWorldTest, SmallerFrictionOfPairHolds) {
  for (const double slope : {0.29, 0.31}) {
    const double angle = std::atan(slope);
    write("<sdf version='1.9'><world name='slope'><gravity>" + std::to_string(9.81 * std::sin(angle)) +
          " 0 " + std::to_string(-9.81 * std::cos(angle)) +
          "</gravity><include><uri>model://ground_plane</uri></include><model name='cube'><pose>0 0 0.05 0 0 "
          "0</pose>"
          "<link name='l'><inertial><mass>1</mass></inertial><collision name='c'><geometry><box><size>0.1 "
          "0.1 0.1"
          "</size></box></geometry><surface><friction><ode><mu>0.3</mu><mu2>0.3</mu2></ode></friction></"
          "surface>"
          "</collision></link></model></world></sdf>");
    start("");
    run(2.0);
    const double way = find("cube").base_pose().translation().x();
    if (slope < 0.3) {
      EXPECT_LT(way, 1e-3);
    } else {
      EXPECT_NEAR(way, 0.5 * 9.81 * (std::sin(angle) - 0.3 * std::cos(angle)) * 4, 0.03);
    }
  }
}

TEST_F(SdfWorldTest, WorldWithoutModelsAndRobotsRuns) {
  write("<sdf version='1.9'><world name='nothing'/></sdf>");
  start("");
  run(0.1);
  EXPECT_EQ(twin_->name(), "nothing");
}

TEST_F(SdfWorldTest, YamlWorldWithoutRobotsRuns) {
  std::ofstream(folder_ / "room.yaml")
      << "objects:\n  - {name: ball, sphere: {radius: 0.1}, xyz: [0, 0, 1], mass: 1}\n";
  Scenario scenario;
  scenario.world = folder_ / "room.yaml";
  bring_up(scenario);
  run(0.2);
  EXPECT_NEAR(find("ball").base_pose().translation().z(), 1 - 0.5 * 9.81 * 0.04, 2e-3);
}

TEST_F(SdfWorldTest, NeitherRobotNorWorldIsRefused) {
  EXPECT_THROW(bring_up(Scenario{}), InputError);
}

}  // namespace
}  // namespace doppel::test
