// Type hashes against those that ROS 2's own generator computes (tests/ros2/*_type_hashes.txt).

#include "doppel/ros/messages/type_hash.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "messages_testing.h"

namespace doppel {
namespace {

const std::string kOurs = "doppel_msgs/";

void add_published(const std::string& name, std::map<std::string, std::string>& hashes) {
  std::ifstream file(std::string(DOPPEL_SOURCE_DIR) + "/tests/ros2/" + name + "_type_hashes.txt");
  EXPECT_TRUE(file.good()) << name;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string type, hash;
    if (!line.starts_with('#') && words >> type >> hash) hashes[type] = hash;
  }
}

// Kilted has the hashes of Lyrical; a type that is in the file of Jazzy alone is equal in all three.
std::map<std::string, std::string> published(Distro distro) {
  std::map<std::string, std::string> hashes;
  add_published("jazzy", hashes);
  if (distro != Distro::jazzy) add_published("lyrical", hashes);
  return hashes;
}

std::map<std::string, std::string> all_hashes() {
  std::map<std::string, std::string> hashes;
  for (const TypeSupport* type : messages_testing::all_types()) hashes[type->name] = type->hash();
  for (const std::string& name : service_names()) hashes[name] = find_service(name)->hash();
  for (const std::string& name : action_names()) hashes[name] = find_action(name)->hash();
  return hashes;
}

class TypeHashOfDistro : public ::testing::TestWithParam<Distro> {
 protected:
  TypeHashOfDistro() { set_ros_distro(GetParam()); }
  ~TypeHashOfDistro() override { set_ros_distro(Distro::jazzy); }
};

TEST_P(TypeHashOfDistro, EveryTypeHasPublishedHash) {
  const auto expected = published(GetParam());
  const auto newest = published(kLastDistro);
  ASSERT_GT(expected.size(), 500U);
  for (const auto& [name, hash] : all_hashes()) {
    // Not part of the published list; SourcesMatchPackage has the .msg texts of ros_gz_interfaces and vision_msgs.
    if (name.starts_with(kOurs) || name.starts_with("test_msgs/") || name.starts_with("ackermann_msgs/") ||
        name.starts_with("linkattacher_msgs/") || name.starts_with("gazebo_ros_link_attacher/") ||
        name.starts_with("ros_gz_interfaces/") || name.starts_with("vision_msgs/") ||
        name.starts_with("resource_retriever_interfaces/"))
      continue;
    const auto found = expected.contains(name) ? expected.find(name) : newest.find(name);
    ASSERT_NE(found, newest.end()) << "expected " << name << " in a distribution";
    EXPECT_EQ(hash, found->second) << name;
  }
}

// gazebo_msgs as far as the twin serves them.
TEST_P(TypeHashOfDistro, ListedPackagesAreComplete) {
  const auto ours = all_hashes();
  std::string missing;
  for (const auto& [name, hash] : published(GetParam())) {
    if (name.starts_with("gazebo_msgs/")) continue;
    if (!ours.contains(name)) missing += name + "\n";
  }
  EXPECT_EQ(missing, "");
}

INSTANTIATE_TEST_SUITE_P(All, TypeHashOfDistro,
                         ::testing::Values(Distro::jazzy, Distro::kilted, Distro::lyrical),
                         [](const auto& each) { return std::string(to_string(each.param)); });

TEST(TypeHash, HashNamesDistrosThatHaveIt) {
  const std::string type = "control_msgs/msg/PidState";
  const auto hash_in = [&](Distro distro) { return published(distro).at(type); };
  EXPECT_EQ(distros_with(type, hash_in(Distro::jazzy)), std::vector{Distro::jazzy});
  EXPECT_EQ(distros_with(type, hash_in(Distro::lyrical)), (std::vector{Distro::kilted, Distro::lyrical}));
  EXPECT_EQ(distros_with(type, "RIHS01_00"), std::vector<Distro>{});
  EXPECT_EQ(distros_with("no_msgs/msg/Such", hash_in(Distro::jazzy)), std::vector<Distro>{});
  EXPECT_EQ(distros_with("std_msgs/msg/String", type_support<std_msgs::msg::String>().hash()).size(),
            kDistros);
}

// The layout follows the distribution: bytes, text and their sizes.
TEST(TypeHash, FieldsOfOtherDistroAreNotWritten) {
  control_msgs::action::FollowJointTrajectory::Feedback feedback;
  feedback.joint_names = {"a"};
  feedback.index = 7;
  const Bytes jazzy = to_cdr(feedback);
  const auto& type = type_support<control_msgs::action::FollowJointTrajectory::Feedback>();
  std::string text;
  ASSERT_TRUE(type.cdr_to_yaml(jazzy, text));
  EXPECT_EQ(text.find("index"), std::string::npos);
  set_ros_distro(Distro::lyrical);
  const Bytes lyrical = to_cdr(feedback);
  control_msgs::action::FollowJointTrajectory::Feedback back, from_jazzy;
  EXPECT_TRUE(from_cdr(lyrical, back));
  EXPECT_FALSE(from_cdr(jazzy, from_jazzy)) << "expected bytes of Jazzy to be too short";
  ASSERT_TRUE(type.cdr_to_yaml(lyrical, text));
  set_ros_distro(Distro::jazzy);
  EXPECT_EQ(back.index, 7);
  EXPECT_NE(text.find("index: 7"), std::string::npos) << text;
  EXPECT_EQ(lyrical.size(), jazzy.size() + 8) << "expected two numbers more";
}

TEST(TypeSources, SourcesMatchDescription) {
  const auto shown = [](const TypeSources& sources) {
    std::string text;
    for (const auto& each : sources)
      text += each.type_name + " (" + each.encoding + ")\n" + each.raw_file_contents;
    return text;
  };
  EXPECT_EQ(shown(type_sources(*find_type("std_msgs/msg/Header")->description())),
            "std_msgs/msg/Header (msg)\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
            "builtin_interfaces/msg/Time (msg)\nint32 sec\nuint32 nanosec\n");
  EXPECT_EQ(shown(type_sources(*find_service("std_srvs/srv/SetBool"))),
            "std_srvs/srv/SetBool (srv)\nbool data\n---\nbool success\nstring message\n"
            "builtin_interfaces/msg/Time (msg)\nint32 sec\nuint32 nanosec\n"
            "service_msgs/msg/ServiceEventInfo (msg)\nuint8 REQUEST_SENT=0\nuint8 REQUEST_RECEIVED=1\n"
            "uint8 RESPONSE_SENT=2\nuint8 RESPONSE_RECEIVED=3\nuint8 event_type\n"
            "builtin_interfaces/Time stamp\nuint8[16] client_gid\nint64 sequence_number\n"
            "std_srvs/srv/SetBool_Event (implicit)\nstd_srvs/srv/SetBool_Request (implicit)\n"
            "std_srvs/srv/SetBool_Response (implicit)\n");
  const ActionSupport& action = *find_action("control_msgs/action/GripperCommand");
  EXPECT_EQ(type_sources(action).size(), 1 + description_message(action).referenced_type_descriptions.size());
  EXPECT_EQ(type_sources(action)[0].encoding, "action");
}

// The fields of the .msg files of ros_gz_interfaces (jazzy) and vision_msgs (4.1), without comments and default values, which are not hashed.
TEST(TypeSources, SourcesMatchPackage) {
  const std::pair<const char*, const char*> cases[] = {
      {"ros_gz_interfaces/msg/Entity",
       "uint8 NONE=0\nuint8 LIGHT=1\nuint8 MODEL=2\nuint8 LINK=3\nuint8 VISUAL=4\nuint8 COLLISION=5\n"
       "uint8 SENSOR=6\nuint8 JOINT=7\nuint64 id\nstring name\nuint8 type\n"},
      {"ros_gz_interfaces/msg/EntityFactory",
       "string name\nbool allow_renaming\nstring sdf\nstring sdf_filename\nstring clone_name\n"
       "geometry_msgs/Pose pose\nstring relative_to\n"},
      {"ros_gz_interfaces/msg/WorldReset", "bool all\nbool time_only\nbool model_only\n"},
      {"ros_gz_interfaces/msg/WorldControl",
       "bool pause\nbool step\nuint32 multi_step\nros_gz_interfaces/WorldReset reset\nuint32 seed\n"
       "builtin_interfaces/Time run_to_sim_time\n"},
      {"vision_msgs/msg/BoundingBox2D", "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n"},
      {"vision_msgs/msg/Pose2D", "vision_msgs/Point2D position\nfloat64 theta\n"},
      {"vision_msgs/msg/ObjectHypothesisWithPose",
       "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n"},
      {"vision_msgs/msg/ObjectHypothesis", "string class_id\nfloat64 score\n"},
      {"vision_msgs/msg/Detection2D",
       "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
       "vision_msgs/BoundingBox2D bbox\nstring id\n"},
      {"vision_msgs/msg/BoundingBox3D", "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n"},
      {"vision_msgs/msg/Detection3D",
       "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
       "vision_msgs/BoundingBox3D bbox\nstring id\n"},
      {"vision_msgs/msg/Detection3DArray", "std_msgs/Header header\nvision_msgs/Detection3D[] detections\n"}};
  for (const auto& [name, fields] : cases)
    EXPECT_EQ(type_sources(*find_type(name)->description()).at(0).raw_file_contents, fields) << name;
}

// What others have published: `ros2 topic info --verbose` and bag files of Jazzy in their documentation and
// logs, hashes in their tests, and code that rosidl generated in their builds (moveit_msgs).
TEST(TypeHash, HashMatchesRos2) {
  const auto ours = all_hashes();
  const std::pair<const char*, const char*> cases[] = {
      {"std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
      {"rosgraph_msgs/msg/Clock", "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
      {"sensor_msgs/msg/JointState", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
      {"sensor_msgs/msg/Range", "b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a"},
      {"tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
      {"trajectory_msgs/msg/JointTrajectory",
       "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e"},
      {"std_srvs/srv/SetBool", "abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a"},
      {"std_srvs/srv/SetBool_Response", "d0814e7f7b4880ab77e9c57426c7aa1562ab69f11eef8e2e968812f9cbd0b059"},
      {"std_srvs/srv/Trigger", "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"},
      {"moveit_msgs/srv/GetPositionIK", "054ed6f6f71a09b01b5246c5d80beb4dacc6f444f58df039849c76292933e9e3"},
      {"moveit_msgs/srv/GetPositionFK", "2f16ec361a135d84b85a29385abeb9eeb025e39c09038bd6b2826645edc7edad"},
      {"moveit_msgs/srv/GetStateValidity",
       "e9fcd24ae0fd8c2f16d4afe397efaf03427d1f899fe91ecf6cb7f7f1c6ca8720"},
  };
  for (const auto& [name, hash] : cases) EXPECT_EQ(ours.at(name), std::string("RIHS01_") + hash) << name;
}

}  // namespace
}  // namespace doppel
