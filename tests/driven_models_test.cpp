// Models of SDF that are robots by their plugins, and gz-sim's services of a world.
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

std::string box_link(const std::string& name, const std::string& pose, const std::string& size, double mass,
                     const std::string& centre = "0 0 0 0 0 0") {
  return "<link name='" + name + "'><pose>" + pose + "</pose><inertial><pose>" + centre + "</pose><mass>" +
         std::to_string(mass) +
         "</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial>" +
         "<collision name='c'><geometry><box><size>" + size + "</size></box></geometry></collision>" +
         "<visual name='v'><geometry><box><size>" + size +
         "</size></box></geometry><material><diffuse>0.2 0.4 1 1</diffuse></material></visual></link>";
}

std::string wheel_link(const std::string& name, double x, double y, const std::string& surface = "") {
  return "<link name='" + name + "'><pose>" + std::to_string(x) + " " + std::to_string(y) +
         " 0.1 -1.5707963 0 0</pose><inertial><mass>1</mass><inertia><ixx>0.004</ixx><iyy>0.004</iyy>"
         "<izz>0.005</izz></inertia></inertial><collision name='c'><geometry><cylinder><radius>0.1</radius>"
         "<length>0.05</length></cylinder></geometry>" +
         surface +
         "</collision><visual "
         "name='v'><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder>"
         "</geometry></visual></link>";
}

std::string wheel_joint(const std::string& name, const std::string& parent, const std::string& child) {
  return "<joint name='" + name + "' type='revolute'><parent>" + parent + "</parent><child>" + child +
         "</child><axis><xyz>0 0 1</xyz></axis></joint>";
}

// Two wheels on the axle through the origin, and a ball without friction behind them.
std::string vehicle(const std::string& name, double y, const std::string& plugins) {
  return "<model name='" + name + "'><pose>0 " + std::to_string(y) + " 0 0 0 0</pose>" +
         box_link("chassis", "0 0 0.12 0 0 0", "0.4 0.24 0.08", 4, "-0.07 0 0 0 0 0") +
         wheel_link("left_wheel", 0, 0.15) + wheel_link("right_wheel", 0, -0.15) +
         "<link name='caster'><pose>-0.15 0 0.04 0 0 "
         "0</pose><inertial><mass>0.2</mass><inertia><ixx>2e-4</ixx>"
         "<iyy>2e-4</iyy><izz>2e-4</izz></inertia></inertial><collision name='c'><geometry><sphere>"
         "<radius>0.04</radius></sphere></geometry><surface><friction><ode><mu>0</mu><mu2>0</mu2></ode>"
         "</friction></surface></collision></link>" +
         wheel_joint("left_wheel_joint", "chassis", "left_wheel") +
         wheel_joint("right_wheel_joint", "chassis", "right_wheel") +
         "<joint name='caster_joint' type='ball'><parent>chassis</parent><child>caster</child></joint>" +
         plugins + "</model>";
}

std::string diff_drive(const std::string& more = "") {
  return "<plugin filename='gz-sim-diff-drive-system' name='gz::sim::systems::DiffDrive'>"
         "<left_joint>left_wheel_joint</left_joint><right_joint>right_wheel_joint</right_joint>"
         "<wheel_separation>0.3</wheel_separation><wheel_radius>0.1</wheel_radius>" +
         more + "</plugin>";
}

std::string classic_drive(const std::string& ros) {
  return "<plugin filename='libgazebo_ros_diff_drive.so' name='drive'>" + ros +
         "<left_joint>left_wheel_joint</left_joint><right_joint>right_wheel_joint</right_joint>"
         "<wheel_separation>0.3</wheel_separation><wheel_diameter>0.2</wheel_diameter></plugin>";
}

class DrivenModels : public TwinFixture {
 protected:
  void SetUp() override {
    folder_ = make_folder("driven_models");
    log_.add_sink([this](const LogLine& line) { logged_ += line.text + "\n"; });
  }
  void write_world(const std::string& models) const {
    std::ofstream(folder_ / "world.sdf") << "<sdf version='1.9'><world name='yard'><include><uri>"
                                            "model://ground_plane</uri></include>" +
                                                models + "</world></sdf>";
  }
  void start(const std::string& models, const std::string& robot = "") {
    write_world(models);
    Scenario scenario;
    if (!robot.empty()) scenario.robots = {{.target = robot}};
    scenario.world = folder_ / "world.sdf";
    bring_up(scenario);
    for (const Diagnostic& d : diagnostics_.all()) said_ += d.message + "\n";
    run(0.3);
  }
  // Publishes a Twist 10 times a second.
  void drive(const std::string& topic, double x, double seconds, double y = 0, double turn = 0) {
    for (int i = 0; i < std::lround(10 * seconds); ++i) {
      publish(topic, "geometry_msgs/msg/Twist",
              "{linear: {x: " + std::to_string(x) + ", y: " + std::to_string(y) +
                  "}, angular: {z: " + std::to_string(turn) + "}}");
      run(0.1);
    }
  }
  [[nodiscard]] Eigen::Vector3d place(const std::string& name) const {
    const auto found = twin_->engine().find(name);
    if (!found) {
      ADD_FAILURE() << "expected an instance " << name;
      return Eigen::Vector3d::Constant(NAN);
    }
    return found->base_pose().translation();
  }
  std::string spawn(const std::string& name, const std::string& xml, const std::string& more = "") {
    std::string out = "no answer";
    const ServiceSupport* service = find_service("gazebo_msgs/srv/SpawnEntity");
    Bytes request;
    const Status converted = service->request->yaml_to_cdr(
        "{name: '" + name + "', xml: \"<sdf version='1.9'>" + xml + "</sdf>\"" + more + "}", request);
    EXPECT_TRUE(converted.ok()) << converted.why();
    edge_->call("/spawn_entity", request, [&out, service](const Status& status, const Bytes& response) {
      out = status ? "" : status.why();
      if (status) static_cast<void>(service->response->cdr_to_yaml(response, out));
    });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (out == "no answer" && std::chrono::steady_clock::now() < end) run(0.001);
    return out;
  }
  std::string world(const std::string& service, const std::string& type, const std::string& yaml) {
    return call("/world/yard/" + service, "ros_gz_interfaces/srv/" + type, yaml);
  }
  [[nodiscard]] std::vector<std::string> namespaces() const {
    std::vector<std::string> out;
    for (const auto& robot : twin_->robots()) out.push_back(robot->name_space());
    return out;
  }

  std::filesystem::path folder_;
  std::string said_, logged_;
};

TEST_F(DrivenModels, TwoVehiclesDriveByTheirOwnTopics) {
  const std::string gently = diff_drive(
      "<max_linear_acceleration>1</max_linear_acceleration><min_linear_acceleration>-1</"
      "min_linear_acceleration>");
  start(vehicle("vehicle_blue", 0, gently) + vehicle("vehicle_green", 2, gently));
  EXPECT_THAT(namespaces(), testing::ElementsAre("vehicle_blue", "vehicle_green")) << said_;
  EXPECT_THAT(said_,
              HasSubstr("it reads /model/vehicle_blue/cmd_vel and publishes /model/vehicle_blue/odometry"));
  listen("/model/vehicle_blue/odometry");
  drive("/model/vehicle_blue/cmd_vel", 0.5, 2.0);
  drive("/model/vehicle_blue/cmd_vel", 0, 1.0);
  EXPECT_NEAR(place("vehicle_blue").x(), 1.0, 0.03);
  EXPECT_NEAR(place("vehicle_green").x(), 0.0, 2e-3);
  const auto odometry = received<nav_msgs::msg::Odometry>("/model/vehicle_blue/odometry");
  ASSERT_THAT(odometry, Not(IsEmpty()));
  EXPECT_NEAR(odometry.back().pose.pose.position.x, place("vehicle_blue").x(), 0.005);
  EXPECT_EQ(odometry.back().header.frame_id, "vehicle_blue/odom");
  EXPECT_EQ(odometry.back().child_frame_id, "vehicle_blue/chassis");
  drive("/model/vehicle_green/cmd_vel", 0.5, 2.0);
  drive("/model/vehicle_green/cmd_vel", 0, 1.0);
  EXPECT_NEAR(place("vehicle_green").x(), 1.0, 0.03);
  EXPECT_NEAR(place("vehicle_blue").x(), 1.0, 0.03);
}

TEST_F(DrivenModels, StandsAsWrittenAndNextToRobot) {
  start(vehicle("vehicle", 2, diff_drive()), "lab_arm");
  EXPECT_THAT(namespaces(), testing::ElementsAre("", "vehicle"));
  EXPECT_NEAR(place("vehicle").z(), 0.12, 2e-3);
  EXPECT_NEAR(place("vehicle").y(), 2, 1e-3);
  // The unnamed joints of the caster turn freely, and nothing holds them.
  for (const ControllerView& c : twin_->robots()[1]->controller_manager().controllers())
    EXPECT_NE(c.type, "joint_trajectory_controller/JointTrajectoryController") << c.name;
}

TEST_F(DrivenModels, TopicsAndFramesOfPluginAreUsed) {
  start(vehicle(
      "vehicle", 0,
      diff_drive("<topic>drive/it</topic><odom_topic>/where</odom_topic>"
                 "<frame_id>vehicle/start</frame_id><child_frame_id>vehicle/chassis</child_frame_id>")));
  listen("/where");
  drive("/drive/it", 0.5, 1.0);
  const auto odometry = received<nav_msgs::msg::Odometry>("/where");
  ASSERT_THAT(odometry, Not(IsEmpty()));
  EXPECT_EQ(odometry.back().header.frame_id, "vehicle/start");
  EXPECT_EQ(odometry.back().child_frame_id, "vehicle/chassis");
  EXPECT_GT(place("vehicle").x(), 0.4);
}

TEST_F(DrivenModels, ClassicPluginHasItsNamespaceAndRemappings) {
  start(
      vehicle("first", 0, classic_drive("")) + vehicle("second", 2, classic_drive("")) +
      vehicle("third", 4,
              classic_drive("<ros><namespace>/fleet/c</namespace><remapping>cmd_vel:=go</remapping></ros>")));
  EXPECT_THAT(namespaces(), testing::ElementsAre("", "second", "fleet/c"));
  listen("/odom");
  drive("/fleet/c/go", 0.5, 1.0);
  EXPECT_GT(place("third").x(), 0.4);
  EXPECT_NEAR(place("first").x(), 0, 2e-3);
  drive("/cmd_vel", 0.5, 1.0);
  EXPECT_GT(place("first").x(), 0.4);
  EXPECT_GT(place("second").x(), 0.4) << "as in Gazebo, both read /cmd_vel";
  const auto odometry = received<nav_msgs::msg::Odometry>("/odom");
  ASSERT_THAT(odometry, Not(IsEmpty()));
}

TEST_F(DrivenModels, MecanumDrivesSideways) {
  const auto rollers = [](int sign) {
    return "<surface><friction><ode><mu>1</mu><mu2>0</mu2><fdir1 gz:expressed_in='chassis'>1 " +
           std::to_string(sign) + " 0</fdir1></ode></friction></surface>";
  };
  const auto plugin =
      "<plugin filename='gz-sim-mecanum-drive-system' name='gz::sim::systems::MecanumDrive'>"
      "<front_left_joint>fl_joint</front_left_joint><front_right_joint>fr_joint</front_right_joint>"
      "<back_left_joint>bl_joint</back_left_joint><back_right_joint>br_joint</back_right_joint>"
      "<wheel_separation>0.3</wheel_separation><wheelbase>0.3</wheelbase><wheel_radius>0.1</wheel_radius></"
      "plugin>";
  start("<model name='omni' xmlns:gz='http://gazebosim.org/schema'>" +
        box_link("chassis", "0 0 0.15 0 0 0", "0.4 0.24 0.08", 4) +
        wheel_link("fl", 0.15, 0.15, rollers(-1)) + wheel_link("fr", 0.15, -0.15, rollers(1)) +
        wheel_link("bl", -0.15, 0.15, rollers(1)) + wheel_link("br", -0.15, -0.15, rollers(-1)) +
        wheel_joint("fl_joint", "chassis", "fl") + wheel_joint("fr_joint", "chassis", "fr") +
        wheel_joint("bl_joint", "chassis", "bl") + wheel_joint("br_joint", "chassis", "br") + plugin +
        "</model>");
  drive("/model/omni/cmd_vel", 0, 2.0, 0.5);
  EXPECT_NEAR(place("omni").y(), 1.0, 0.1) << said_;
  EXPECT_NEAR(place("omni").x(), 0.0, 0.05);
}

TEST_F(DrivenModels, AckermannDrivesOnItsArc) {
  const auto steer = [](const std::string& side, double y) {
    return "<link name='" + side + "_steer'><pose>0.15 " + std::to_string(y) +
           " 0.1 0 0 "
           "0</pose><inertial><mass>0.5</mass><inertia><ixx>0.002</ixx><iyy>0.002</iyy><izz>0.002</izz>"
           "</inertia></inertial></link><joint name='" +
           side + "_steer_joint' type='revolute'><parent>chassis</parent><child>" + side +
           "_steer</child><axis><xyz>0 0 "
           "1</xyz><limit><lower>-0.6</lower><upper>0.6</upper></limit></axis></joint>";
  };
  start(
      "<model name='car'>" + box_link("chassis", "0 0 0.15 0 0 0", "0.4 0.2 0.08", 4) + steer("left", 0.15) +
      steer("right", -0.15) + wheel_link("fl", 0.15, 0.15) + wheel_link("fr", 0.15, -0.15) +
      wheel_link("rl", -0.15, 0.15) + wheel_link("rr", -0.15, -0.15) +
      wheel_joint("fl_joint", "left_steer", "fl") + wheel_joint("fr_joint", "right_steer", "fr") +
      wheel_joint("rl_joint", "chassis", "rl") + wheel_joint("rr_joint", "chassis", "rr") +
      "<plugin filename='ignition-gazebo-ackermann-steering-system' "
      "name='ignition::gazebo::systems::AckermannSteering'>"
      "<left_joint>fl_joint</left_joint><left_joint>rl_joint</left_joint><right_joint>fr_joint</right_joint>"
      "<right_joint>rr_joint</right_joint><left_steering_joint>left_steer_joint</left_steering_joint>"
      "<right_steering_joint>right_steer_joint</right_steering_joint><kingpin_width>0.3</kingpin_width>"
      "<wheel_base>0.3</wheel_base><wheel_separation>0.3</wheel_separation><wheel_radius>0.1</wheel_radius>"
      "</plugin></model>");
  drive("/model/car/cmd_vel", 0.5, 2.0);
  EXPECT_NEAR(place("car").x(), 1.0, 0.1) << said_;
  EXPECT_NEAR(place("car").y(), 0.0, 0.02);
  drive("/model/car/cmd_vel", 0.5, 2.0, 0, 0.5);
  EXPECT_GT(place("car").y(), 0.3) << "expected a turn to the left";
}

// A post with a turning arm, and plugins of gz-sim for its joint.
std::string post(const std::string& plugins) {
  return "<model name='post'><joint name='foot' "
         "type='fixed'><parent>world</parent><child>base</child></joint>" +
         box_link("base", "0 0 0.5 0 0 0", "0.1 0.1 1", 10) +
         box_link("arm", "0.3 0 1.1 0 0 0", "0.6 0.05 0.05", 1) +
         "<joint name='turn' type='revolute'><pose>-0.3 0 0 0 0 "
         "0</pose><parent>base</parent><child>arm</child>"
         "<axis><xyz>0 0 1</xyz></axis></joint>" +
         plugins + "</model>";
}

TEST_F(DrivenModels, JointFollowsPositionCommand) {
  start(
      post("<plugin filename='gz-sim-joint-position-controller-system' name='gz::sim::systems::"
           "JointPositionController'><joint_name>turn</joint_name><topic>turn_to</topic><p_gain>1</p_gain>"
           "<initial_position>0.2</initial_position></plugin>"
           "<plugin filename='gz-sim-joint-state-publisher-system' "
           "name='gz::sim::systems::JointStatePublisher'/>"));
  EXPECT_THAT(said_, HasSubstr("it reads /turn_to (std_msgs/msg/Float64); without effect: p_gain"));
  run(2.0);
  EXPECT_NEAR(joint("turn").q, 0.2, 0.01);
  listen("/world/yard/model/post/joint_state");
  publish("/turn_to", "std_msgs/msg/Float64", "{data: 1.0}");
  run(3.0);
  EXPECT_NEAR(joint("turn").q, 1.0, 0.01);
  const auto states = received<sensor_msgs::msg::JointState>("/world/yard/model/post/joint_state");
  ASSERT_THAT(states, Not(IsEmpty()));
  ASSERT_THAT(states.back().position, SizeIs(1));
  EXPECT_NEAR(states.back().position[0], 1.0, 0.01);
}

TEST_F(DrivenModels, JointFollowsVelocityCommandAtItsUsualTopic) {
  start(
      post("<plugin filename='ignition-gazebo-joint-controller-system' name='ignition::gazebo::systems::"
           "JointController'><joint_name>turn</joint_name></plugin>"));
  publish("/model/post/joint/turn/cmd_vel", "std_msgs/msg/Float64", "{data: 0.5}");
  run(2.0);
  EXPECT_NEAR(joint("turn").v, 0.5, 0.02) << said_;
}

TEST_F(DrivenModels, TrajectoryOfAllJointsIsFollowed) {
  start(
      post("<plugin filename='gz-sim-joint-trajectory-controller-system' name='gz::sim::systems::"
           "JointTrajectoryController'/>"));
  publish("/model/post/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
          "{joint_names: [turn], points: [{positions: [0.7], time_from_start: {sec: 1}}]}");
  run(2.0);
  EXPECT_NEAR(joint("turn").q, 0.7, 0.01) << said_;
}

TEST_F(DrivenModels, PluginThatCannotBeMappedLeavesObject) {
  start(post(
      "<plugin filename='gz-sim-joint-position-controller-system' name='x'><joint_name>tur</joint_name>"
      "</plugin><plugin filename='gz-sim-pose-publisher-system' name='gz::sim::systems::PosePublisher'/>"));
  EXPECT_THAT(namespaces(), IsEmpty());
  EXPECT_THAT(said_, HasSubstr("names the joint 'tur', which does not move or exist; did you mean 'turn'?"));
  EXPECT_THAT(said_,
              HasSubstr("the plugin 'gz-sim-pose-publisher-system' of a <model> has no effect: poses are"));
}

TEST_F(DrivenModels, SpawnedModelDrivesAndIsDeleted) {
  start("");
  EXPECT_THAT(namespaces(), IsEmpty());
  EXPECT_THAT(spawn("rover", vehicle("vehicle", 0, diff_drive()), ", initial_pose: {position: {y: 1}}"),
              HasSubstr("success: true"));
  ASSERT_THAT(namespaces(), testing::ElementsAre("rover")) << logged_;
  drive("/model/rover/cmd_vel", 0.5, 2.0);
  EXPECT_NEAR(place("rover").x(), 1.0, 0.05);
  EXPECT_NEAR(place("rover").y(), 1.0, 0.02);
  EXPECT_THAT(spawn("fleet", vehicle("vehicle", 3, classic_drive("")), ", robot_namespace: /fleet/x"),
              HasSubstr("success: true"));
  drive("/fleet/x/cmd_vel", 0.5, 1.0);
  EXPECT_GT(place("fleet").x(), 0.4) << logged_;
  for (const char* name : {"rover", "fleet"})
    EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", std::string("{name: ") + name + "}"),
                HasSubstr("success: true"));
  EXPECT_THAT(namespaces(), IsEmpty());
  run(0.1);
}

// By its name, the robot is a part of the object.
TEST_F(DrivenModels, DeletedModelTakesItsDrivenPart) {
  start("<model name='cart'>" + box_link("loose", "0 2 0.05 0 0 0", "0.1 0.1 0.1", 1) + "</model>" +
        vehicle("cart::drive", 0, diff_drive()));
  ASSERT_THAT(namespaces(), SizeIs(1)) << said_;
  const std::size_t objects = twin_->engine().world().instances().size();
  EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: cart}"),
              HasSubstr("success: true"));
  EXPECT_THAT(namespaces(), IsEmpty());
  EXPECT_EQ(twin_->engine().world().instances().size(), objects - 2);
  run(0.1);
}

TEST_F(DrivenModels, ReloadKeepsControllersPoseAndDeletion) {
  start(vehicle("one", 0, diff_drive()) + vehicle("two", 2, diff_drive()));
  drive("/model/one/cmd_vel", 0.5, 1.0);
  EXPECT_THAT(world("remove", "DeleteEntity", "{entity: {name: two, type: 2}}"), HasSubstr("success: true"));
  const double before = place("one").x();
  write_world(vehicle("one", 0, diff_drive()) + vehicle("two", 2, diff_drive()) +
              vehicle("three", 4, diff_drive()));
  Diagnostics said;
  const auto next = Twin::prepare(twin_->running(), said);
  twin_->replace(next);
  EXPECT_THAT(namespaces(), testing::ElementsAre("one", "three"));
  EXPECT_NEAR(place("one").x(), before, 1e-9);
  drive("/model/one/cmd_vel", 0.5, 1.0);
  EXPECT_GT(place("one").x(), before + 0.4);
}

TEST_F(DrivenModels, DescriptionIsPublishedAsUrdf) {
  start(vehicle("vehicle", 0, diff_drive()));
  const std::string& urdf = twin_->robot().description().xml;
  EXPECT_THAT(urdf, HasSubstr("<robot name=\"vehicle\">"));
  Diagnostics said;
  PackageResolver resolver;
  const RobotDescription again = parse_urdf(urdf, "vehicle.urdf", resolver, said);
  said.throw_if_errors();
  const RobotDescription& robot = twin_->robot().description();
  ASSERT_EQ(again.links.size(), robot.links.size());
  ASSERT_EQ(again.joints.size(), robot.joints.size());
  const Joint& wheel = *again.find_joint("left_wheel_joint");
  EXPECT_EQ(wheel.type, JointType::continuous);
  EXPECT_LT(
      (wheel.origin.pose().matrix() - robot.find_joint("left_wheel_joint")->origin.pose().matrix()).norm(),
      1e-12);
  EXPECT_EQ(again.find_link("chassis")->visuals.at(0).material->rgba->z(), 1.0);
}

// -- gz-sim's services

constexpr const char* kBall =
    "<model name='ball'><link name='l'><inertial><mass>1</mass></inertial><collision "
    "name='c'><geometry><sphere>"
    "<radius>0.1</radius></sphere></geometry></collision></link></model>";

// A part that no joint connects is added after the robot; its failure must neither end the twin nor leave
// half a model.
TEST_F(DrivenModels, PartThatCannotBeAddedRemovesSpawnedModel) {
  start(kBall);
  spawn_ball("cart::loose", {5, 5, 5});
  twin_->between_steps();
  std::string cart = vehicle("cart", 0, diff_drive());
  cart.insert(cart.find("<plugin"), box_link("loose", "0 0 1 0 0 0", "0.1 0.1 0.1", 1));
  const std::string said = spawn("cart", cart);
  EXPECT_THAT(said, HasSubstr("success: false"));
  EXPECT_THAT(said, HasSubstr("cart::loose"));
  EXPECT_FALSE(twin_->engine().find("cart"));
  EXPECT_TRUE(twin_->robots().empty());
  run(0.1);
}

TEST_F(DrivenModels, WorldServicesCreateMoveAndRemove) {
  start(kBall);
  const std::string sdf = std::string("sdf: \"<sdf version='1.9'>") + kBall + "</sdf>\"";
  EXPECT_THAT(
      world("create", "SpawnEntity", "{entity_factory: {name: two, " + sdf + ", pose: {position: {x: 2}}}}"),
      HasSubstr("success: true"));
  EXPECT_NEAR(place("two").x(), 2, 1e-9);
  EXPECT_THAT(world("create", "SpawnEntity", "{entity_factory: {" + sdf + "}}"), HasSubstr("success: false"));
  EXPECT_THAT(logged_, HasSubstr("/world/yard/create: there is already an object 'ball'"));
  EXPECT_THAT(world("create", "SpawnEntity",
                    "{entity_factory: {allow_renaming: true, relative_to: two, " + sdf +
                        ", pose: {position: {y: 1}}}}"),
              HasSubstr("success: true"));
  EXPECT_NEAR(place("ball_0").x(), 2, 1e-3);
  EXPECT_NEAR(place("ball_0").y(), 1, 1e-3);
  EXPECT_THAT(world("create", "SpawnEntity",
                    "{entity_factory: {name: copy, clone_name: ball, pose: {position: {x: 4, z: 1}}}}"),
              HasSubstr("success: true"));
  EXPECT_NEAR(place("copy").z(), 1, 1e-9);
  EXPECT_THAT(world("create", "SpawnEntity", "{entity_factory: {name: none}}"), HasSubstr("success: false"));
  EXPECT_THAT(world("create", "SpawnEntity", "{entity_factory: {sdf_filename: /etc/passwd}}"),
              HasSubstr("success: false"));
  EXPECT_THAT(
      world("set_pose", "SetEntityPose", "{entity: {name: two}, pose: {position: {x: 3, y: 3, z: 1}}}"),
      HasSubstr("success: true"));
  EXPECT_NEAR(place("two").y(), 3, 1e-9);
  EXPECT_THAT(world("remove", "DeleteEntity", "{entity: {name: two, type: 2}}"), HasSubstr("success: true"));
  EXPECT_FALSE(twin_->engine().find("two"));
  EXPECT_THAT(world("remove", "DeleteEntity", "{entity: {id: 7}}"), HasSubstr("success: false"));
  EXPECT_THAT(logged_, HasSubstr("found by their names here"));
}

TEST_F(DrivenModels, FileInPackageIsCreated) {
  start("");
  std::filesystem::create_directories(folder_ / "ball");
  std::ofstream(folder_ / "ball" / "model.sdf") << "<sdf version='1.9'>" << kBall << "</sdf>";
  const std::string request =
      "{entity_factory: {sdf_filename: '" + (folder_ / "ball" / "model.sdf").string() + "'}}";
  EXPECT_THAT(world("create", "SpawnEntity", request), HasSubstr("success: false"));
  EXPECT_THAT(logged_, HasSubstr("is in no package and beside no model.config"));
  std::ofstream(folder_ / "ball" / "model.config") << "<model><name>ball</name></model>";
  EXPECT_THAT(world("create", "SpawnEntity", request), HasSubstr("success: true"));
  EXPECT_TRUE(twin_->engine().find("ball"));
}

TEST_F(DrivenModels, VehicleIsMovedAndDrivesOn) {
  start(vehicle("vehicle", 0, diff_drive()));
  drive("/model/vehicle/cmd_vel", 0.5, 1.0);
  EXPECT_THAT(world("set_pose", "SetEntityPose",
                    "{entity: {name: vehicle}, pose: {position: {x: -3, y: 1}, orientation: {z: 1, w: 0}}}"),
              HasSubstr("success: true"))
      << logged_;
  EXPECT_NEAR(place("vehicle").x(), -3, 1e-9);
  EXPECT_NEAR(place("vehicle").z(), 0.12, 1e-9) << "the model's frame is at the asked pose, not the chassis";
  drive("/model/vehicle/cmd_vel", 0.5, 1.0);
  EXPECT_LT(place("vehicle").x(), -3.3);
}

TEST_F(DrivenModels, ControlPausesStepsAndResets) {
  start(vehicle("vehicle", 0, diff_drive()) + kBall);
  TimeControl& time = twin_->time_control();
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {pause: true, multi_step: 5}}"),
              HasSubstr("success: true"));
  EXPECT_TRUE(time.paused);
  EXPECT_EQ(time.steps_owed, 5u);
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {}}"), HasSubstr("success: true"));
  EXPECT_FALSE(time.paused);
  EXPECT_EQ(time.steps_owed, 0u);
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {step: true}}"), HasSubstr("success: false"));
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {reset: {time_only: true}}}"),
              HasSubstr("success: false"));
  drive("/model/vehicle/cmd_vel", 0.5, 1.0);
  const Time now = twin_->now();
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {reset: {model_only: true}}}"),
              HasSubstr("success: true"));
  EXPECT_EQ(twin_->now(), now);
  EXPECT_NEAR(place("vehicle").x(), 0, 1e-9);
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {reset: {all: true}}}"),
              HasSubstr("success: true"));
  EXPECT_EQ(twin_->now(), Time{});
}

TEST_F(DrivenModels, SeedOfControlIsReportedOnceAsWithoutEffect) {
  start(kBall);
  for (int i = 0; i < 2; ++i)
    EXPECT_THAT(world("control", "ControlWorld", "{world_control: {seed: 1}}"), HasSubstr("success: true"));
  const std::string note =
      "the physics has no random numbers, and those of sensors follow from the seed at the start";
  ASSERT_THAT(logged_, HasSubstr(note));
  EXPECT_EQ(logged_.find(note), logged_.rfind(note));
}

TEST_F(DrivenModels, RunToSimTimePausesThere) {
  start(kBall);
  EXPECT_THAT(
      world("control", "ControlWorld", "{world_control: {run_to_sim_time: {sec: 0, nanosec: 100000000}}}"),
      HasSubstr("success: false"));
  EXPECT_THAT(logged_, HasSubstr("run_to_sim_time is 0.1 s, and it is 0.3 s already"));
  EXPECT_THAT(world("control", "ControlWorld", "{world_control: {run_to_sim_time: {sec: 1}}}"),
              HasSubstr("success: true"));
  TimeControl& time = twin_->time_control();
  while (!time.paused && twin_->now() < time_from_seconds(2.0)) run(0.001);
  EXPECT_EQ(twin_->now(), time_from_seconds(1.0));
}

}  // namespace
}  // namespace doppel::test
