// SDF worlds written as SDF, YAML and MJCF, and read back.
#include "doppel/review/conversion/world_documents.h"

#include <gmock/gmock.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <tuple>

#include "conversion_fixture.h"
#include "doppel/base/core/output_file.h"
#include "doppel/physics/contract/world.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

const std::string kWorldOfAll = R"(<sdf version="1.9"><world name="w"><gravity>0 0 -3.7</gravity>
<physics name="p" type="ode"><max_step_size>0.002</max_step_size></physics>
<scene><ambient>0.1 0.2 0.3 1</ambient><background>0.4 0.5 0.6 1</background><shadows>false</shadows>
  <sky><time>12.5</time><sunrise>5</sunrise><sunset>21</sunset></sky></scene>
<light name="sun" type="directional"><direction>0 0 -1</direction></light>
<light name="lamp" type="spot"><pose>1 2 3 1.5 0 0</pose><diffuse>0.9 0.8 0.7 1</diffuse>
  <specular>0.2 0.3 0.4 1</specular>
  <direction>0 1 0</direction><cast_shadows>true</cast_shadows><intensity>0.6</intensity>
  <attenuation><range>7</range><constant>0.5</constant><linear>0.02</linear><quadratic>0.003</quadratic></attenuation>
  <spot><inner_angle>0.2</inner_angle><outer_angle>0.8</outer_angle><falloff>1.5</falloff></spot></light>
<plugin filename="libwind.so" name="wind"><force>2</force></plugin>
<model name="floor"><static>true</static><link name="l"><collision name="c">
  <geometry><plane><normal>0 0 1</normal></plane></geometry>
  <surface><friction><ode><mu>0.5</mu></ode></friction>
    <bounce><restitution_coefficient>0.75</restitution_coefficient></bounce></surface></collision></link></model>
<frame name="corner"><pose>1 0 0 0 0 1.57079632679</pose></frame>
<model name="ball"><pose relative_to="corner">2 0 1 0 0 0</pose><link name="l"><inertial auto="true"/>
  <collision name="c"><density>500</density><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model>
<model name="rod"><pose>0 -1 2 0.1 0.2 0.3</pose><link name="l">
  <inertial><mass>2</mass><inertia><ixx>9</ixx><iyy>9</iyy><izz>9</izz></inertia></inertial>
  <collision name="c"><geometry><capsule><radius>0.1</radius><length>0.5</length></capsule></geometry>
  <surface><friction><ode><mu>0.7</mu><mu2>0.2</mu2>
      <fdir1 gz:expressed_in="l">0 1 0</fdir1><slip1>0.01</slip1><slip2>0.02</slip2></ode>
    <torsional><coefficient>0.4</coefficient><patch_radius>0.03</patch_radius></torsional></friction>
    <bounce><restitution_coefficient>0.25</restitution_coefficient></bounce>
    <contact><ode><kp>1e6</kp><kd>100</kd><max_vel>0.1</max_vel><min_depth>0.002</min_depth></ode></contact>
  </surface></collision></link></model>
<model name="table"><static>true</static><pose>3 0 0 0 0 0</pose><link name="l">
  <collision name="top"><pose>0 0 0.7 0 0 0</pose><geometry><box><size>1 1 0.1</size></box></geometry></collision>
  <collision name="leg"><pose>0 0 0.3 0 0 0</pose>
    <geometry><cylinder><radius>0.05</radius><length>0.6</length></cylinder></geometry></collision>
  <collision name="hat"><pose>0 0 1 0 0 0</pose>
    <geometry><cone><radius>0.1</radius><length>0.2</length></cone></geometry></collision></link></model>
<model name="door"><pose>5 0 0 0 0 0</pose><link name="post"><inertial><mass>1</mass></inertial></link>
  <link name="leaf"><pose>0.5 0 0 0 0 0</pose><inertial><mass>1</mass></inertial>
  <collision name="c"><geometry><box><size>1 0.05 2</size></box></geometry></collision></link>
  <joint name="fix" type="fixed"><parent>world</parent><child>post</child></joint>
  <joint name="hinge" type="revolute"><parent>post</parent><child>leaf</child><axis><xyz>0 0 1</xyz></axis></joint></model>
<model name="camera"><static>true</static><pose>0 5 0 0 0 0</pose><link name="l">
  <visual name="v"><geometry><sphere><radius>0.1</radius></sphere></geometry></visual>
  <sensor name="eye" type="camera"><pose relative_to="__model__">0 0 1 0 0 0</pose><update_rate>30</update_rate></sensor></link>
  <plugin filename="libsee.so" name="see"/></model>
<include><uri>stand.urdf</uri><pose>0 4 0 0 0 1.57079632679</pose></include>
</world></sdf>)";

// The root is the world, and its first joint has an origin.
const std::string kStand = R"(<robot name="stand"><link name="world"/>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="1 0 0.5" rpy="0.1 0.2 0.3"/></joint>
<link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<joint name="lift" type="prismatic"><parent link="base"/><child link="top"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
  <limit lower="0" upper="1" effort="100" velocity="1"/></joint>
<link name="top"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<gazebo reference="top"><sensor name="height" type="altimeter"/></gazebo></robot>)";

class WorldDocuments : public ::testing::Test {
 protected:
  WorldDocuments()
      : folder_(fresh_folder(testing::UnitTest::GetInstance()->current_test_info()->name())),
        files_({folder_, false, std::nullopt}) {
    Diagnostics found;
    write_whole(folder_ / "stand.urdf", kStand);
    world_ = parse_sdf(kWorldOfAll, "w.sdf", folder_, resolver_, found);
  }
  std::filesystem::path written(const std::string& name, const std::string& text) {
    files_.write();
    write_whole(folder_ / name, text);
    return folder_ / name;
  }
  [[nodiscard]] std::string said() const {
    std::string out;
    for (const Diagnostic& one : diagnostics_.all()) out += one.message + "\n";
    return out;
  }
  static double distance(const Pose& a, const Pose& b) {
    return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
  }

  const std::filesystem::path folder_;
  MeshFiles files_;
  PackageResolver resolver_;
  SdfWorld world_;
  Diagnostics diagnostics_;
};

TEST_F(WorldDocuments, SdfReadsBackWithItsGround) {
  Diagnostics found;
  const SdfWorld again =
      parse_sdf(to_world_sdf(world_, files_, diagnostics_), "again.sdf", folder_, resolver_, found);
  EXPECT_TRUE(again.settings.ground);
  EXPECT_EQ(again.settings.ground_friction, 0.5);
  EXPECT_EQ(again.settings.step, world_.settings.step);
  EXPECT_EQ(again.settings.ground_restitution, 0.75);
  for (const SdfModel& model : world_.models) {
    const SdfModel* const same = again.find(model.name);
    ASSERT_NE(same, nullptr) << model.name;
    // The world, of which SDF has no link, is not the root of the model that is read back.
    const Pose X_WR =
        model.name == "stand" ? model.X_WR * make_pose({1, 0, 0.5}, {0.1, 0.2, 0.3}) : model.X_WR;
    EXPECT_LT(distance(same->X_WR, X_WR), 1e-9) << model.name;
    EXPECT_EQ(same->is_static, model.is_static) << model.name;
  }
}

TEST_F(WorldDocuments, SdfReadsBackWithItsLights) {
  Diagnostics found;
  const SdfWorld again =
      parse_sdf(to_world_sdf(world_, files_, diagnostics_), "again.sdf", folder_, resolver_, found);
  ASSERT_EQ(again.settings.lights.size(), 2u);
  for (std::size_t i = 0; i < again.settings.lights.size(); ++i) {
    const Light &a = again.settings.lights[i], &b = world_.settings.lights[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_LT(distance(a.X_WL, b.X_WL), 1e-9) << b.name;
    EXPECT_LT((a.direction_W - b.direction_W).norm(), 1e-9) << b.name;
    EXPECT_EQ(a.diffuse, b.diffuse);
    EXPECT_EQ(a.specular, b.specular);
    EXPECT_EQ(a.cast_shadows, b.cast_shadows);
    EXPECT_EQ(
        std::make_tuple(a.range, a.attenuation_constant, a.attenuation_linear, a.attenuation_quadratic),
        std::make_tuple(b.range, b.attenuation_constant, b.attenuation_linear, b.attenuation_quadratic));
    EXPECT_EQ(std::make_tuple(a.inner_angle, a.outer_angle, a.falloff, a.intensity),
              std::make_tuple(b.inner_angle, b.outer_angle, b.falloff, b.intensity));
  }
}

TEST_F(WorldDocuments, SdfReadsBackWithItsScene) {
  Diagnostics found;
  const SdfWorld again =
      parse_sdf(to_world_sdf(world_, files_, diagnostics_), "again.sdf", folder_, resolver_, found);
  ASSERT_TRUE(again.settings.environment && again.settings.environment->sky);
  const Environment& scene = *again.settings.environment;
  EXPECT_EQ(scene.ambient, Eigen::Vector4d(0.1, 0.2, 0.3, 1));
  EXPECT_EQ(scene.background, Eigen::Vector4d(0.4, 0.5, 0.6, 1));
  EXPECT_FALSE(scene.shadows);
  EXPECT_EQ(std::make_tuple(scene.sky->time, scene.sky->sunrise, scene.sky->sunset),
            std::make_tuple(12.5, 5.0, 21.0));
}

TEST_F(WorldDocuments, SdfReadsBackWithItsSurfaces) {
  Diagnostics found;
  const SdfWorld again =
      parse_sdf(to_world_sdf(world_, files_, diagnostics_), "again.sdf", folder_, resolver_, found);
  const SdfModel* const rod = again.find("rod");
  ASSERT_NE(rod, nullptr);
  const ContactSurface& s = rod->description->links.front().collisions.front().surface;
  EXPECT_EQ(std::make_tuple(s.mu, s.mu2, s.slip1, s.slip2, s.torsional_mu, s.patch_radius),
            std::make_tuple(0.7, 0.2, 0.01, 0.02, 0.4, 0.03));
  ASSERT_TRUE(s.fdir1);
  EXPECT_LT((*s.fdir1 - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_EQ(std::make_tuple(s.kp, s.kd, s.max_velocity, s.min_depth, s.restitution),
            std::make_tuple(1e6, 100.0, 0.1, 0.002, 0.25));
  const SdfModel* const ball = again.find("ball");
  ASSERT_NE(ball, nullptr);
  EXPECT_EQ(ball->description->links.front().collisions.front().surface.mu, 1.0);
}

TEST_F(WorldDocuments, SdfReadsBackWithItsPluginsAndSensors) {
  Diagnostics found;
  const SdfWorld again =
      parse_sdf(to_world_sdf(world_, files_, diagnostics_), "again.sdf", folder_, resolver_, found);
  ASSERT_EQ(again.plugins.size(), 1u);
  EXPECT_EQ(again.plugins[0].filename, "libwind.so");
  EXPECT_THAT(again.plugins[0].xml, HasSubstr("<force>2</force>"));
  const SdfModel* const camera = again.find("camera");
  ASSERT_NE(camera, nullptr);
  ASSERT_EQ(camera->sensors.size(), 1u);
  EXPECT_EQ(camera->sensors[0].name, "eye");
  EXPECT_LT(distance(camera->sensors[0].X_LS, make_pose({0, 0, 1}, {0, 0, 0})), 1e-9);
  EXPECT_THAT(to_xml(camera->sensors[0].node), HasSubstr("<update_rate>30</update_rate>"));
  ASSERT_EQ(camera->description->gazebo.size(), 1u);
  EXPECT_EQ(camera->description->gazebo[0].plugins.at(0).name, "see");
  EXPECT_EQ(again.find("stand")->sensors.size(), 1u) << "expected the sensor of its <gazebo> once";
}

TEST_F(WorldDocuments, YamlReadsBackWhatItExpresses) {
  const auto file = written("w.yaml", to_world_yaml(world_, files_, diagnostics_));
  const World again = load_world(file, resolver_);
  EXPECT_EQ(again.name, "w");
  EXPECT_EQ(again.gravity.z(), -3.7);
  EXPECT_EQ(again.step, world_.settings.step);
  EXPECT_TRUE(again.ground);
  EXPECT_EQ(again.ground_friction, 0.5);
  EXPECT_EQ(again.friction_rule, FrictionRule::smaller);
  const auto object = [&](const std::string& name) {
    const auto found = std::ranges::find(again.objects, name, &WorldObject::name);
    EXPECT_NE(found, again.objects.end()) << name;
    return found == again.objects.end() ? WorldObject() : *found;
  };
  EXPECT_EQ(again.objects.size(), 4u);
  const WorldObject ball = object("ball"), rod = object("rod"), top = object("table/top"),
                    leg = object("table/leg");
  EXPECT_LT(distance(ball.X_WO, make_pose({1, 2, 1}, {0, 0, std::acos(0.0)})), 1e-9)
      << "expected the resolved pose";
  EXPECT_NEAR(ball.mass, 500 * 4.0 / 3 * 2 * std::acos(0.0) * 0.001, 1e-9);
  EXPECT_LT(distance(rod.X_WO, world_.find("rod")->X_WR), 1e-9);
  EXPECT_EQ(std::get<Capsule>(rod.shape).length, 0.5);
  EXPECT_EQ(rod.restitution, 0.25);
  EXPECT_EQ(ball.restitution, std::nullopt);
  EXPECT_EQ(again.ground_restitution, 0.75);
  EXPECT_EQ(top.mass, 0);
  EXPECT_LT(distance(top.X_WO, make_pose({3, 0, 0.7}, {0, 0, 0})), 1e-9);
  EXPECT_EQ(std::get<Box>(top.shape).size, Eigen::Vector3d(1, 1, 0.1));
  EXPECT_EQ(std::get<Cylinder>(leg.shape).radius, 0.05);
}

TEST_F(WorldDocuments, YamlReportsWhatItLoses) {
  to_world_yaml(world_, files_, diagnostics_);
  const std::string text = said();
  for (const char* lost :
       {"the light 'sun'", "the light 'lamp'", "the plugin 'wind'", "the plugin 'see' of 'camera'",
        "the sensor 'eye' of 'camera'", "the sensor 'height' of 'stand'",
        "the model 'door', which has 2 links", "the model 'stand', which has 3 links",
        "the model 'camera', which collides with nothing", "the shape 'hat' of 'table'",
        "the inertia of 'rod', which is not that of a uniform shape", "the <scene>",
        "the direction, slip or torsion of the surface of 'rod'"})
    EXPECT_THAT(text, HasSubstr(lost));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("inertia of 'ball'")));
  EXPECT_EQ(diagnostics_.all().size(), 13u) << text;
  for (const Diagnostic& one : diagnostics_.all()) EXPECT_GT(one.where.line, 0) << one.message;
}

TEST_F(WorldDocuments, MjcfIsReadByMujocoWithSamePoses) {
  const auto file = written("w.xml", to_world_mjcf(world_, files_, diagnostics_));
  char problem[1000] = "";
  mjModel* const model = mj_loadXML(file.c_str(), nullptr, problem, sizeof problem);
  ASSERT_NE(model, nullptr) << problem;
  mjData* const data = mj_makeData(model);
  mj_forward(model, data);
  EXPECT_EQ(model->opt.gravity[2], -3.7);
  EXPECT_EQ(model->opt.timestep, 0.002);
  EXPECT_EQ(model->geom_solref[0], 0.01) << "expected 5 steps";
  EXPECT_EQ(model->nu, 0) << "expected joints that move freely";
  EXPECT_EQ(model->nv, 6 + 6 + 1 + 1);
  const auto place = [&](const char* name) {
    const int id = mj_name2id(model, mjOBJ_BODY, name);
    EXPECT_GE(id, 0) << name;
    return Eigen::Vector3d(data->xpos[3 * id], data->xpos[3 * id + 1], data->xpos[3 * id + 2]);
  };
  EXPECT_LT((place("ball/l") - Eigen::Vector3d(1, 2, 1)).norm(), 1e-9);
  EXPECT_LT((place("door/leaf") - Eigen::Vector3d(5.5, 0, 0)).norm(), 1e-9);
  EXPECT_LT((place("stand/base") - Eigen::Vector3d(0, 5, 0.5)).norm(), 1e-9)
      << "expected the pose of the included model with the origin of its first joint";
  const Pose X_WT = world_.find("stand")->X_WR * make_pose({1, 0, 0.5}, {0.1, 0.2, 0.3}) *
                    make_pose({0, 0, 0.5}, {0, 0, 0});
  EXPECT_LT((place("stand/top") - X_WT.translation()).norm(), 1e-9);
  EXPECT_GE(mj_name2id(model, mjOBJ_JOINT, "door/hinge"), 0);
  for (int i = 0; i < 2000; ++i) mj_step(model, data);
  EXPECT_NEAR(place("ball/l").z(), 0.1, 0.005) << "expected it on the ground";
  mj_deleteData(data);
  mj_deleteModel(model);
  EXPECT_THAT(said(), HasSubstr("MuJoCo takes the larger friction"));
}

TEST_F(WorldDocuments, MjcfReportsWhatItLoses) {
  to_world_mjcf(world_, files_, diagnostics_);
  std::string lost;
  for (const Diagnostic& one : diagnostics_.all()) {
    if (one.rule == "world.lost") lost += one.message + "\n";
  }
  for (const char* what :
       {"the plugin 'wind'", "the plugin 'see' of 'camera'", "the sensor 'eye' of 'camera'",
        "the sensor 'height' of 'stand'", "the restitution of the ground", "the restitution of 'l' of 'rod'"})
    EXPECT_THAT(lost, HasSubstr(std::string(what) + " cannot be written to MJCF"));
  EXPECT_THAT(lost, ::testing::Not(HasSubstr("light")));
  EXPECT_THAT(lost, ::testing::Not(HasSubstr("of 'ball'")));
}

}  // namespace
}  // namespace doppel
