// Objects that are added, removed and moved while a twin runs, as from another shell or the page.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/ros/messages/visualization_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using ::testing::HasSubstr;
using visualization_msgs::msg::Marker;
using visualization_msgs::msg::MarkerArray;

class EntityTest : public TwinFixture {
 protected:
  // Times that are whole steps: without a step of the world's own, the one of the lab arm follows its 225 Hz.
  void bring_up_lab_arm_at_1_ms() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    const std::string file = ::testing::TempDir() + info->name() + std::string(".yaml");
    std::ofstream(file) << "step: 0.001\n";
    Scenario scenario;
    scenario.robots = {{.target = "lab_arm"}};
    scenario.world = file;
    bring_up(scenario);
  }
  static std::string ball(const std::string& name, double mass = 0.1) {
    const std::string inertial =
        mass > 0 ? "<inertial><mass>" + std::to_string(mass) + "</mass></inertial>" : "";
    return "<sdf version='1.7'><model name='" + name + "'><static>" + (mass > 0 ? "false" : "true") +
           "</static><link name='link'>" + inertial +
           "<collision name='c'><geometry><sphere><radius>0.05</radius></sphere></geometry></collision>"
           "</link></model></sdf>";
  }
  std::string spawn(const std::string& name, const std::string& xml, const std::string& pose = "{}",
                    const std::string& frame = "''") {
    return call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                "{name: '" + name + "', xml: \"" + xml + "\", initial_pose: " + pose +
                    ", reference_frame: " + frame + "}");
  }
  static std::string rubber_ball(const std::string& name) {
    std::string out = ball(name, 0.5);
    out.insert(out.find("</collision>"),
               "<surface><friction><torsional><coefficient>1</coefficient><patch_radius>0.05</patch_radius>"
               "</torsional></friction></surface>");
    return out;
  }
  static std::string at(double x, double y, double z) {
    return "{position: {x: " + std::to_string(x) + ", y: " + std::to_string(y) + ", z: " + std::to_string(z) +
           "}}";
  }
  std::string remove(const std::string& name) {
    return call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: '" + name + "'}");
  }
  [[nodiscard]] Eigen::Vector3d where(const std::string& name) const {
    const std::optional<const Instance> object = std::as_const(*twin_).engine().find(name);
    EXPECT_TRUE(object) << name;
    return object ? object->base_pose().translation() : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  [[nodiscard]] bool is_there(const std::string& name) const {
    return std::as_const(*twin_).engine().find(name).has_value();
  }
};

TEST_F(EntityTest, SpawnedEntityFallsAndIsDeleted) {
  bring_up("lab_arm");
  run(0.2);
  EXPECT_THAT(spawn("ball", ball("x"), at(1, 0, 0.5)), HasSubstr("success: true"));
  EXPECT_NEAR(where("ball").z(), 0.5, 1e-9);
  run(1.0);
  EXPECT_NEAR(where("ball").z(), 0.05, 2e-3) << "expected the ball to rest on the ground";
  EXPECT_THAT(remove("ball"), HasSubstr("success: true"));
  EXPECT_FALSE(is_there("ball"));
  EXPECT_THAT(remove("ball"), HasSubstr("there is no entity"));
}

TEST_F(EntityTest, NameIsTakenFromXml) {
  bring_up("lab_arm");
  run(0.2);
  const double q = joint("j1").q;
  EXPECT_THAT(spawn("", ball("named")), HasSubstr("named'' is in the world"));
  EXPECT_EQ(joint("j1").q, q);
}

TEST_F(EntityTest, InvalidEntityIsRefusedWithoutChange) {
  bring_up("lab_arm");
  const std::string robot = twin_->robot().name();
  EXPECT_THAT(spawn("a", ball("a")), HasSubstr("success: true"));
  EXPECT_THAT(spawn("a", ball("a")), HasSubstr("there is already an object 'a'"));
  EXPECT_THAT(spawn(robot, ball("a")), HasSubstr("already used by the robot"));
  EXPECT_THAT(spawn("ground", ball("a")), HasSubstr("already used by the robot or its world"));
  EXPECT_THAT(spawn("a::b", ball("a")), HasSubstr("without '::'"));
  for (const char* name : {"' '", "\"a\\nb\"", "\"\\e[31m\"", "\"\\x9b\"", "\xff"}) {
    const std::string said = call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                                  "{name: " + std::string(name) + ", xml: \"" + ball("a") + "\"}");
    EXPECT_THAT(said, ::testing::Not(HasSubstr("success: true"))) << name;
  }
  EXPECT_THAT(spawn("b", "<sdf/>"), HasSubstr("neither a <world> nor a <model>"));
  EXPECT_THAT(spawn("b", "not xml"), HasSubstr("success: false"));
  EXPECT_THAT(spawn("b", ball("b"), at(0, 0, 1), "nowhere"), HasSubstr("frame of reference is unknown"));
  EXPECT_THAT(spawn("b", ball("b"), "{position: {x: .nan}}"), HasSubstr("is not valid"));
  EXPECT_THAT(spawn("b", ball("b"), "{orientation: {x: 0, y: 0, z: 0, w: 0}}"), HasSubstr("is not valid"));
  EXPECT_THAT(spawn("b", ball("b"), at(1e9, 0, 0)), HasSubstr("more than"));
  EXPECT_THAT(
      spawn("b",
            "<sdf version='1.7'><model name='b'><link name='l'><collision name='c'><geometry><mesh><uri>"
            "file:///etc/passwd.stl</uri></mesh></geometry></collision></link></model></sdf>"),
      HasSubstr("is outside the robot"));
  EXPECT_EQ(twin_->engine().world().instances().size(), 2u) << "expected the robot and one object";
  EXPECT_THAT(remove(robot), HasSubstr("is the robot"));
  EXPECT_THAT(remove("ground"), HasSubstr("the ground"));
}

TEST_F(EntityTest, NumberIsLimited) {
  bring_up("lab_arm");
  std::vector<ModelInstance> many = twin_->engine().world().instances();
  CollisionMeshes meshes;
  for (int i = 0; i < 200; ++i) {
    WorldObject object;
    object.name = "o" + std::to_string(i);
    object.shape = Sphere{0.01};
    object.X_WO.translation() << 1 + 0.1 * i, 0, 1;
    many.push_back(make_instance(object, meshes, diagnostics_));
  }
  twin_->engine().set_instances(many);
  twin_->between_steps();
  EXPECT_THAT(spawn("more", ball("more")), HasSubstr("200 objects"));
}

TEST_F(EntityTest, EntityAddedByEngineIsListed) {
  bring_up("lab_arm");
  listen("/doppel/objects");
  run(0.1);
  WorldObject post;
  post.name = "post";
  post.shape = Box{{0.1, 0.1, 1}};
  post.X_WO.translation() << 1, 0, 0.5;
  CollisionMeshes meshes;
  twin_->engine().spawn(make_instance(post, meshes, diagnostics_));
  run(0.1);
  const auto markers = received<MarkerArray>("/doppel/objects");
  ASSERT_FALSE(markers.empty());
  EXPECT_EQ(markers.back().markers.at(0).text, "post");
}

TEST_F(EntityTest, StatesAreReportedInFrames) {
  bring_up("lab_arm");
  spawn("base", ball("base", 0), at(1, 2, 0.5));
  EXPECT_THAT(spawn("near", ball("near", 0), at(0, 0, 1), "base"), HasSubstr("success: true"));
  EXPECT_TRUE(where("near").isApprox(Eigen::Vector3d(1, 2, 1.5), 1e-9));
  const std::string state = call("/gazebo/get_entity_state", "gazebo_msgs/srv/GetEntityState",
                                 "{name: near, reference_frame: 'base::link'}");
  EXPECT_THAT(state, HasSubstr("success: true"));
  EXPECT_THAT(state, HasSubstr("z: 1.0"));
  EXPECT_THAT(call("/gazebo/get_entity_state", "gazebo_msgs/srv/GetEntityState", "{name: neer}"),
              HasSubstr("success: false"));
  EXPECT_THAT(call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
                   "{state: {name: near, pose: {position: {x: -1}}, reference_frame: world}}"),
              HasSubstr("success: true"));
  EXPECT_TRUE(where("near").isApprox(Eigen::Vector3d(-1, 0, 0), 1e-9));
  EXPECT_THAT(call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
                   "{state: {name: near, pose: {position: {x: .inf}}}}"),
              HasSubstr("success: false"));
  EXPECT_THAT(call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
                   "{state: {name: " + twin_->robot().name() + "}}"),
              HasSubstr("success: false"));
}

TEST_F(EntityTest, TwistCanBeSet) {
  bring_up_lab_arm_at_1_ms();
  spawn("ball", ball("ball"));
  call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
       "{state: {name: ball, pose: {position: {x: 2, z: 1}}, twist: {linear: {y: 3}}}}");
  run(0.1);
  EXPECT_NEAR(where("ball").y(), 0.3, 1e-3);
  EXPECT_THAT(call("/gazebo/get_model_state", "gazebo_msgs/srv/GetModelState", "{model_name: ball}"),
              HasSubstr("y: 3.0"));
}

TEST_F(EntityTest, ResetRestoresPoses) {
  bring_up("lab_arm");
  spawn("ball", ball("ball"), at(1, 0, 1));
  run(0.6);
  EXPECT_LT(where("ball").z(), 0.5);
  call("/gazebo/reset_simulation", "std_srvs/srv/Empty", "{}");
  EXPECT_NEAR(where("ball").z(), 1.0, 1e-9);
}

TEST_F(EntityTest, MarkersArePublished) {
  bring_up("lab_arm");
  listen("/doppel/objects");
  run(0.1);
  auto markers = received<MarkerArray>("/doppel/objects");
  ASSERT_EQ(markers.size(), 1u) << "expected one message, without markers";
  EXPECT_TRUE(markers[0].markers.empty());
  spawn("ball", ball("ball"), at(1, 0, 1));
  spawn("post", ball("post", 0), at(-1, 0, 1));
  run(0.4);
  markers = received<MarkerArray>("/doppel/objects");
  EXPECT_GE(markers.size(), 9u);
  EXPECT_LE(markers.size(), 13u) << "expected 25 Hz while the ball falls";
  const MarkerArray last = markers.back();
  ASSERT_EQ(last.markers.size(), 2u);
  EXPECT_EQ(last.markers[0].text, "ball");
  EXPECT_EQ(last.markers[0].ns, "objects");
  EXPECT_EQ(last.markers[0].type, Marker::SPHERE);
  EXPECT_EQ(last.markers[0].scale.x, 0.1);
  EXPECT_EQ(last.markers[0].header.frame_id, "world");
  EXPECT_LT(last.markers[0].pose.position.z, 0.99);
  const int post = last.markers[1].id;
  remove("ball");
  markers = received<MarkerArray>("/doppel/objects");
  ASSERT_EQ(markers.size(), 1u) << "expected a message while paused, too";
  ASSERT_EQ(markers[0].markers.size(), 2u);
  EXPECT_EQ(markers[0].markers[0].id, post) << "expected ids to be preserved";
  EXPECT_EQ(markers[0].markers[1].action, Marker::DELETE);
  EXPECT_EQ(markers[0].markers[1].id, last.markers[0].id);
  run(0.5);
  EXPECT_TRUE(received<MarkerArray>("/doppel/objects").empty()) << "expected no message while nothing moves";
}

TEST_F(EntityTest, ContactForceEqualsWeight) {
  bring_up("lab_arm");
  spawn("ball", ball("ball", 0.5), at(1, 0, 0.05));
  run(1.0);
  listen("/gazebo/contacts");
  run(0.5);
  const auto markers = received<gazebo_msgs::msg::ContactsState>("/gazebo/contacts");
  EXPECT_NEAR(static_cast<double>(markers.size()), 15.0, 2.0);
  const auto& states = markers.back().states;
  const auto touch = std::ranges::find_if(states, [](const auto& s) {
    return s.collision1_name == "ball::link::collision" || s.collision2_name == "ball::link::collision";
  });
  ASSERT_NE(touch, states.end());
  const bool first = touch->collision1_name == "ball::link::collision";
  EXPECT_EQ(first ? touch->collision2_name : touch->collision1_name, "ground::link::collision");
  // On the first of the two; the ball's weight presses on the ground.
  EXPECT_NEAR(touch->total_wrench.force.z, (first ? 1 : -1) * 0.5 * 9.81, 0.05);
  EXPECT_NEAR(touch->contact_normals.at(0).z, first ? 1 : -1, 1e-6);
  EXPECT_NEAR(touch->contact_positions.at(0).x, 1.0, 1e-2);
}

// A shape that has another pose than its model: 0.1 m beside it and turned by 90 degrees about z.
constexpr const char* kBeside =
    "<sdf version='1.7'><model name='can'><link name='body'><pose>0.1 0 0 0 0 1.5707963267948966</pose>"
    "<inertial><mass>2</mass></inertial><collision name='c'><pose>0 0 0.2 0 0 0</pose>"
    "<geometry><box><size>0.1 0.1 0.1</size></box></geometry></collision></link></model></sdf>";

class EntityStateTest : public EntityTest {
 protected:
  gazebo_msgs::msg::EntityState state_of(const std::string& name, const std::string& frame = "") {
    const std::string said = call("/gazebo/get_entity_state", "gazebo_msgs/srv/GetEntityState",
                                  "{name: '" + name + "', reference_frame: '" + frame + "'}");
    gazebo_msgs::srv::GetEntityState::Response out;
    Bytes cdr;
    const Status read = find_service("gazebo_msgs/srv/GetEntityState")->response->yaml_to_cdr(said, cdr);
    EXPECT_TRUE(read.ok() && from_cdr(cdr, out).ok() && out.success) << said;
    return out.state;
  }
  std::string put(const std::string& name, const std::string& state, const std::string& frame = "") {
    return call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
                "{state: {name: '" + name + "', reference_frame: '" + frame + "', " + state + "}}");
  }
  std::string push(const std::string& request) {
    return call("/gazebo/apply_link_wrench", "gazebo_msgs/srv/ApplyLinkWrench", request);
  }
  Marker marker(const std::string& name) {
    run(0.001);
    for (const MarkerArray& markers : received<MarkerArray>("/doppel/objects")) {
      for (const Marker& one : markers.markers) {
        if (one.text == name) last_ = one;
      }
    }
    return last_;
  }
  static void expect_same(const geometry_msgs::msg::Pose& a, const geometry_msgs::msg::Pose& b) {
    EXPECT_NEAR(a.position.x, b.position.x, 1e-4);
    EXPECT_NEAR(a.position.y, b.position.y, 1e-4);
    EXPECT_NEAR(a.position.z, b.position.z, 1e-4);
    EXPECT_NEAR(std::abs(a.orientation.x * b.orientation.x + a.orientation.y * b.orientation.y +
                         a.orientation.z * b.orientation.z + a.orientation.w * b.orientation.w),
                1.0, 1e-6);
  }

 private:
  Marker last_;
};

TEST_F(EntityStateTest, StateMatchesMarker) {
  bring_up("lab_arm");
  listen("/doppel/objects");
  ASSERT_THAT(spawn("can", kBeside, at(1, 2, 3)), HasSubstr("success: true"));
  EXPECT_NEAR(state_of("can").pose.position.x, 1.0, 1e-9)
      << "expected the model's frame where it was spawned";
  EXPECT_NEAR(state_of("can::body").pose.position.x, 1.1, 1e-9) << "expected the link's frame";
  const auto shape = state_of("can::link::collision").pose;
  EXPECT_NEAR(shape.position.x, 1.1, 1e-9);
  EXPECT_NEAR(shape.position.z, 3.2, 1e-9);
  EXPECT_NEAR(shape.orientation.z, std::sqrt(0.5), 1e-9);
  expect_same(marker("can").pose, shape);
  // The pose of a marker may be sent back: nothing moves.
  const std::string markers =
      "pose: {position: {x: 1.1, y: 2, z: 3.2}, orientation: {z: 0.70710678118654752, w: "
      "0.70710678118654752}}";
  EXPECT_THAT(put("can::link::collision", markers), HasSubstr("success: true"));
  EXPECT_TRUE(where("can").isApprox(Eigen::Vector3d(1.1, 2, 3), 1e-9)) << where("can").transpose();
}

TEST_F(EntityStateTest, ShapeMovesAsRigidBody) {
  bring_up("lab_arm");
  spawn("can", kBeside, at(1, 2, 3));
  EXPECT_THAT(put("can::link::collision",
                  "pose: {position: {x: 5, y: 0, z: 2}}, twist: {linear: {x: 1}, angular: {z: 2}}"),
              HasSubstr("success: true"));
  const auto shape = state_of("can::link::collision");
  EXPECT_NEAR(shape.pose.position.x, 5, 1e-9);
  EXPECT_NEAR(shape.twist.linear.x, 1, 1e-9);
  EXPECT_NEAR(shape.twist.linear.y, 0, 1e-9);
  // The model's frame is 0.1 m along the shape's y, and rotates about the shape.
  const auto body = state_of("can");
  EXPECT_NEAR(body.pose.position.y, 0.1, 1e-9);
  EXPECT_NEAR(body.twist.linear.x, 1 - 2 * 0.1, 1e-9);
}

TEST_F(EntityStateTest, WrenchPushesObject) {
  bring_up_lab_arm_at_1_ms();
  spawn("can", kBeside, at(1, 2, 30));
  spawn("post", ball("post", 0), at(-1, 0, 1));
  // At the centre of the shape: F/m, and no rotation. 0.2 s of 10 N on 2 kg.
  EXPECT_THAT(
      push("{link_name: 'can::link::collision', wrench: {force: {y: 10}}, duration: {nanosec: 200000000}}"),
      HasSubstr("success: true"));
  run(0.2);
  EXPECT_NEAR(state_of("can").twist.linear.y, 1.0, 1e-6);
  EXPECT_NEAR(state_of("can").twist.angular.z, 0.0, 1e-9);
  run(0.2);
  EXPECT_NEAR(state_of("can").twist.linear.y, 1.0, 1e-6)
      << "expected the wrench to act for its duration only";
  // The same force at the model's origin, 0.1 m beside: torque 1 N m about a box's m a^2 / 6.
  push("{link_name: can, wrench: {force: {y: -10}}, duration: {nanosec: 1000000}}");
  run(0.001);
  EXPECT_NEAR(state_of("can").twist.angular.z, 1.0 / (2 * 0.01 / 6) * 0.001, 1e-4);
  EXPECT_THAT(push("{link_name: post, wrench: {force: {y: 10}}, duration: {sec: -1}}"),
              HasSubstr("fixed to the world"));
  EXPECT_THAT(push("{link_name: cann, wrench: {force: {y: 10}}, duration: {sec: -1}}"),
              HasSubstr("did you mean 'can'"));
}

TEST_F(EntityStateTest, ContactTorqueEqualsTorsionOnFirstBody) {
  bring_up("lab_arm");
  spawn("ball", rubber_ball("ball"), at(1, 0, 0.05));
  run(0.5);
  push("{link_name: ball, wrench: {torque: {z: 0.01}}, duration: {sec: -1}}");
  run(0.5);
  listen("/gazebo/contacts");
  run(0.1);
  const auto messages = received<gazebo_msgs::msg::ContactsState>("/gazebo/contacts");
  ASSERT_FALSE(messages.empty());
  bool found = false;
  for (const auto& state : messages.back().states) {
    const bool first = state.collision1_name == "ball::link::collision";
    if (!first && state.collision2_name != "ball::link::collision") continue;
    found = true;
    EXPECT_NEAR(state.total_wrench.torque.z, first ? -0.01 : 0.01, 1e-4);
    EXPECT_NEAR(state.wrenches.at(0).torque.z, state.total_wrench.torque.z, 1e-12);
  }
  EXPECT_TRUE(found);
}

TEST_F(EntityStateTest, WrenchEndsWithObject) {
  bring_up("lab_arm");
  spawn("ball", ball("ball", 1), at(1, 0, 50));
  push("{link_name: ball, wrench: {force: {z: 9.81}}, duration: {sec: -1}}");
  spawn("other", ball("other", 1), at(2, 0, 50));  // the physics model is recreated
  run(0.5);
  EXPECT_NEAR(where("ball").z(), 50, 1e-6) << "expected the ball to be held by the wrench";
  call("/gazebo/clear_link_wrenches", "gazebo_msgs/srv/LinkRequest", "{link_name: 'ball::link'}");
  run(0.1);
  EXPECT_LT(state_of("ball").twist.linear.z, -0.9) << "expected the ball to fall after the wrench is cleared";
  push("{link_name: ball, wrench: {force: {z: 9.81}}, duration: {sec: -1}}");
  run(0.01);
  remove("ball");
  spawn("ball", ball("ball", 1), at(1, 0, 50));
  push("{link_name: other, wrench: {force: {x: 1}}, duration: {sec: -1}}");  // all loads are written again
  run(0.1);
  EXPECT_LT(state_of("ball").twist.linear.z, -0.9)
      << "expected the wrench not to act on a new ball of that name";
}

// With a world file, edited and deleted from while the twin runs.
class WorldEntitiesTest : public EntityStateTest {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    world_ = std::filesystem::path(::testing::TempDir()) / (std::string(info->name()) + "_world.yaml");
    write_world(0.5);
    Scenario scenario;
    scenario.robots = {{.target = "lab_arm"}};
    scenario.world = world_;
    bring_up(scenario);
  }
  void TearDown() override { std::filesystem::remove(world_); }
  void write_world(double shelf) {
    std::ofstream(world_) << "robot: {xyz: [0, 0, 0.2]}\nobjects:\n"
                             "  - {name: shelf, box: [0.2, 0.2, 0.02], xyz: [1, 0, "
                          << shelf
                          << "]}\n  - {name: cup, sphere: {radius: 0.03}, xyz: [2, 0, 0.5], mass: 0.1}\n";
  }
  void reload() {
    Diagnostics said;
    twin_->replace(Twin::prepare(twin_->running(), said));
  }

  std::filesystem::path world_;
};

TEST_F(WorldEntitiesTest, EntitiesSurviveReload) {
  EXPECT_THAT(spawn("ball", ball("ball"), at(3, 0, 5)), HasSubstr("success: true"));
  EXPECT_THAT(spawn("post", ball("post", 0), at(-3, 0, 1)), HasSubstr("success: true"));
  EXPECT_THAT(remove("cup"), HasSubstr("success: true"));
  run(0.3);
  const double z = where("ball").z();
  write_world(0.7);
  for (int i = 0; i < 2; ++i) {
    reload();
    EXPECT_NEAR(where("ball").z(), z, 1e-9);
    EXPECT_NEAR(where("post").x(), -3, 1e-9);
    EXPECT_NEAR(where("shelf").z(), 0.7, 1e-9) << "expected the shelf where the edited file has it";
    EXPECT_FALSE(is_there("cup")) << "expected the deleted entity to stay deleted";
  }
  const FrameVelocity velocity = twin_->engine().find("ball").value().base_velocity();
  EXPECT_NEAR(velocity.linear_W.z(), -0.3 * 9.81, 0.02) << "expected the ball to continue to fall";
}

TEST_F(WorldEntitiesTest, EntitiesAreInWorldFrame) {
  listen("/tf_static");
  run(0.1);
  const Pose X_WR = twin_->robot().instance().link_pose(0);
  EXPECT_NEAR(X_WR.translation().z(), 0.2, 1e-9);
  const bool root_is_world = twin_->robot().model().links.front().name == "world";
  double ground = 0;
  const auto frames = received<tf2_msgs::msg::TFMessage>("/tf_static");
  ASSERT_FALSE(frames.empty());
  for (const auto& transform : frames.back().transforms) {
    if (transform.child_frame_id == "ground") ground = transform.transform.translation.z;
  }
  EXPECT_NEAR(ground, root_is_world ? -0.2 : 0.0, 1e-9) << "expected the ground in the world frame, too";
  listen("/doppel/objects");
  run(0.1);
  const auto markers = received<MarkerArray>("/doppel/objects");
  ASSERT_FALSE(markers.empty());
  EXPECT_EQ(markers.back().markers.at(0).text, "shelf");
  EXPECT_NEAR(markers.back().markers.at(0).pose.position.z, root_is_world ? 0.3 : 0.5, 1e-9);
  expect_same(markers.back().markers.at(0).pose, state_of("shelf").pose);
  spawn("post", ball("post", 0), at(3, 0, 1), "world");
  EXPECT_NEAR(state_of("post").pose.position.z, 1, 1e-9);
  EXPECT_NEAR(marker("post").pose.position.z, 1, 1e-9);
  put("post", "pose: {position: {x: 3, z: 2}}");
  EXPECT_NEAR(marker("post").pose.position.z, 2, 1e-9);
  EXPECT_NEAR(state_of("post").pose.position.z, 2, 1e-9);
}

}  // namespace
}  // namespace doppel::test
