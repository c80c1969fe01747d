// YAML, JSON and schema text.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/ros/messages/type_description.h"
#include "doppel/ros/messages/visualization_msgs.h"

namespace doppel {
namespace {

using testing::HasSubstr;

template <class M>
M read(std::string_view yaml) {
  Bytes bytes;
  M message;
  const Status status = type_support<M>().yaml_to_cdr(yaml, bytes);
  EXPECT_TRUE(status) << status.why();
  EXPECT_TRUE(!status || from_cdr(bytes, message));
  return message;
}

template <class M>
std::string error_of(std::string_view yaml) {
  Bytes bytes;
  const Status status = type_support<M>().yaml_to_cdr(yaml, bytes);
  EXPECT_FALSE(status) << yaml;
  return status.why();
}

template <class M>
std::string yaml_of(const M& message) {
  std::string text;
  EXPECT_TRUE(type_support<M>().cdr_to_yaml(to_cdr(message), text));
  return text;
}

using Trajectory = trajectory_msgs::msg::JointTrajectory;
using sensor_msgs::msg::JointState;
using std_msgs::msg::Float64;
using std_msgs::msg::Int32;
using std_msgs::msg::String;

TEST(YamlReader, FlowStyleIsRead) {
  const auto t = read<Trajectory>(
      "{joint_names: [Revolute 2, 'Revolute 3'], points: [{positions: [1, -0.5e0], time_from_start: {sec: "
      "3}}]}");
  EXPECT_EQ(t.joint_names, (std::vector<std::string>{"Revolute 2", "Revolute 3"}));
  ASSERT_EQ(t.points.size(), 1U);
  EXPECT_EQ(t.points[0].positions, (std::vector<double>{1.0, -0.5}));
  EXPECT_EQ(t.points[0].time_from_start.sec, 3);
  EXPECT_TRUE(t.header.frame_id.empty());
}

TEST(YamlReader, BlockStyleWithDefaultsAndRos1TimesIsRead) {
  const auto t = read<Trajectory>(
      "header:\n  stamp: {secs: 120, nsecs: 5}\npoints:\n- time_from_start:\n    nsecs: 7\n");
  EXPECT_EQ(t.header.stamp.sec, 120);
  EXPECT_EQ(t.header.stamp.nanosec, 5U);
  EXPECT_EQ(t.points.at(0).time_from_start.nanosec, 7U);
  EXPECT_EQ(read<geometry_msgs::msg::Pose>("{position: {x: 1}}").orientation.w, 1.0);
  EXPECT_EQ(read<geometry_msgs::msg::Pose>("").orientation.w, 1.0);
  EXPECT_EQ(read<JointState>("{header: auto, name: [a]}").header.stamp.sec, 0);
  EXPECT_EQ(read<std_msgs::msg::Header>("stamp: now").stamp.sec, 0);
  read<std_srvs::srv::Trigger::Request>("{}");
}

TEST(YamlReader, SpecialNumbersAreRead) {
  EXPECT_TRUE(std::isnan(read<Float64>("{data: .nan}").data));
  EXPECT_EQ(read<Float64>("{data: -.inf}").data, -INFINITY);
  EXPECT_EQ(read<Float64>("{data: +1.5}").data, 1.5);
  EXPECT_EQ(read<Float64>("{data: 1e-3}").data, 1e-3);
  EXPECT_EQ(read<Int32>("{data: -2147483648}").data, INT32_MIN);
  EXPECT_EQ(read<Int32>("{data: 0x10}").data, 16);
  EXPECT_EQ(read<String>("{data: 12}").data, "12");
  EXPECT_TRUE(read<std_msgs::msg::Bool>("{data: yes}").data);
}

TEST(YamlReader, AliasStandsForItsAnchor) {
  const auto t = read<Trajectory>("points: [&a {positions: &p [1, 2]}, *a, {velocities: *p, effort: []}]");
  ASSERT_EQ(t.points.size(), 3U);
  EXPECT_EQ(t.points[1].positions, (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(t.points[2].velocities, (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(error_of<JointState>("{name: &a [*a]}"),
            "1:8: a list, but 'name' is a string; an empty one is ''");
  EXPECT_THAT(error_of<JointState>("{name: [*b]}"), HasSubstr("not YAML"));
  std::string long_names = "{name: [&a " + std::string(std::size_t{1} << 20, 'a');
  for (int i = 0; i < 64; ++i) long_names += ", *a";
  EXPECT_THAT(error_of<JointState>(long_names + ", b]}"), HasSubstr("larger than 64 MiB"));
}

TEST(YamlReader, UnknownFieldIsRefusedWithPlaceAndNearest) {
  const std::string why = error_of<Trajectory>("joint_names: [a]\npoints:\n- postions: [1]\n");
  EXPECT_THAT(why, HasSubstr("3:3: "));
  EXPECT_THAT(why, HasSubstr("trajectory_msgs/msg/JointTrajectoryPoint has no field 'postions'"));
  EXPECT_THAT(why, HasSubstr("did you mean 'positions'?"));
  EXPECT_THAT(error_of<std_srvs::srv::Trigger::Request>("{a: 1}"), HasSubstr("no field 'a'"));
}

TEST(YamlReader, WrongTypesAreRefused) {
  EXPECT_THAT(error_of<JointState>("{position: 1}"), HasSubstr("1:12: '1', but 'position' is a list"));
  EXPECT_THAT(error_of<JointState>("{position: [a]}"), HasSubstr("'a', but 'position' is a number"));
  EXPECT_THAT(error_of<JointState>("{name: [[a]]}"), HasSubstr("is a string"));
  EXPECT_THAT(error_of<JointState>("{header: 3}"), HasSubstr("where a std_msgs/msg/Header is expected"));
  EXPECT_THAT(error_of<Int32>("{data: 1.5}"), HasSubstr("is an integer"));
  EXPECT_THAT(error_of<Int32>("{data: 2147483648}"), HasSubstr("does not fit into the int32"));
  EXPECT_THAT(error_of<std_msgs::msg::Header>("stamp: {nanosec: -1}"),
              HasSubstr("does not fit into the uint32"));
  EXPECT_THAT(error_of<std_msgs::msg::Bool>("{data: 1}"), HasSubstr("true or false"));
  EXPECT_THAT(error_of<std_msgs::msg::ColorRGBA>("{r: 1e300}"), HasSubstr("float32"));
  EXPECT_THAT(error_of<Int32>("{data: 1, data: 2}"), HasSubstr("given twice"));
  EXPECT_THAT(error_of<Int32>("[1]"), HasSubstr("write it as {data: ...}"));
  EXPECT_THAT(error_of<Int32>("{data: "), HasSubstr("not YAML"));
  EXPECT_THAT(error_of<Int32>("data: 1\n---\ndata: 2\n"), HasSubstr("several YAML documents"));
  EXPECT_THAT(error_of<String>("data:\n"), HasSubstr("is a string"));
  EXPECT_THAT(error_of<unique_identifier_msgs::msg::UUID>("{uuid: [1, 2]}"),
              HasSubstr("needs 16 elements, but 2 are given"));
  EXPECT_FALSE(error_of<Int32>(std::string(100000, '[')).empty());
}

TEST(YamlWriter, OutputMatchesRos2TopicEcho) {
  tf2_msgs::msg::TFMessage tf;
  auto& t = tf.transforms.emplace_back();
  t.header.frame_id = "world";
  t.child_frame_id = "1";
  t.transform.translation = {1e-5, -0.0001, 1e16};
  EXPECT_EQ(yaml_of(tf),
            "transforms:\n- header:\n    stamp:\n      sec: 0\n      nanosec: 0\n    frame_id: world\n"
            "  child_frame_id: '1'\n  transform:\n    translation:\n      x: 1.0e-05\n      y: -0.0001\n"
            "      z: 1.0e+16\n    rotation:\n      x: 0.0\n      y: 0.0\n      z: 0.0\n      w: 1.0\n");
  JointState state;
  state.name = {"a b", "it's", "", "true", "x: y"};
  state.position = {NAN, INFINITY, 0.1};
  EXPECT_EQ(
      yaml_of(state),
      "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: ''\nname:\n- a b\n- it's\n- ''\n- 'true'\n"
      "- 'x: y'\nposition:\n- .nan\n- .inf\n- 0.1\nvelocity: []\neffort: []\n");
  EXPECT_EQ(yaml_of(std_msgs::msg::Empty{}), "{}\n");
  EXPECT_EQ(yaml_of(String{"<a>\n  <b/>\n</a>"}), "data: \"<a>\\n  <b/>\\n</a>\"\n");
  EXPECT_EQ(yaml_of(String{"one\ntwo"}), "data: 'one\n\n  two'\n");
}

TEST(ShortestDecimal, TextEqualsPythonRepr) {
  const std::pair<double, const char*> cases[] = {
      {0, "0.0"},           {-0.0, "-0.0"},
      {1, "1.0"},           {100, "100.0"},
      {123.456, "123.456"}, {0.0001, "0.0001"},
      {0.00001, "1e-05"},   {1e15, "1000000000000000.0"},
      {1e16, "1e+16"},      {1.5e300, "1.5e+300"},
      {5e-324, "5e-324"},   {1234567890123456.7, "1234567890123456.8"},
      {-0.25, "-0.25"}};
  for (const auto& [value, text] : cases) EXPECT_EQ(shortest_decimal(value), text);
}

TEST(JsonWriter, OutputIsCompactWithoutNan) {
  JointState state;
  state.header.stamp = {3, 4};
  state.name = {"a\"\\\n\x01", "\xFF"};
  state.position = {NAN, 1.5};
  std::string json;
  ASSERT_TRUE(type_support<JointState>().cdr_to_json(to_cdr(state), json));
  EXPECT_EQ(
      json,
      "{\"header\":{\"stamp\":{\"sec\":3,\"nanosec\":4},\"frame_id\":\"\"},\"name\":[\"a\\\"\\\\\\n\\u0001\","
      "\"\xEF\xBF\xBD\"],\"position\":[null,1.5],\"velocity\":[],\"effort\":[]}");
}

TEST(MessageSchema, DependenciesAreListedOnce) {
  const std::string line(80, '=');
  EXPECT_EQ(
      type_support<JointState>().schema(),
      "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n" +
          line + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + line +
          "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
  const std::string status = type_support<action_msgs::msg::GoalStatus>().schema();
  EXPECT_THAT(status, HasSubstr("int8 STATUS_SUCCEEDED=4\n"));
  EXPECT_THAT(status, HasSubstr("uint8[16] uuid\n"));
}

TEST(TimeText, NegativeTimeKeepsNanosecPositive) {
  EXPECT_EQ(to_duration_msg(std::chrono::milliseconds(-500)).sec, -1);
  EXPECT_EQ(to_duration_msg(std::chrono::milliseconds(-500)).nanosec, 500000000U);
  EXPECT_EQ(from_msg(to_duration_msg(std::chrono::milliseconds(-1500))), std::chrono::milliseconds(-1500));
}

TEST(MessageSchema, ByteIsNotUint8) {
  // The names differ in ROS 2's type hashes and schemas, the wire does not.
  const std::string schema = schema_text(describe<diagnostic_msgs::msg::DiagnosticStatus>());
  EXPECT_THAT(schema, HasSubstr("byte WARN=1\n"));
  EXPECT_THAT(schema, HasSubstr("byte level\n"));
  const auto status = read<diagnostic_msgs::msg::DiagnosticStatus>("{level: 2, name: arm}");
  EXPECT_EQ(status.level, diagnostic_msgs::msg::DiagnosticStatus::ERROR);
  EXPECT_THAT(yaml_of(status), HasSubstr("level: 2\n"));
  EXPECT_THAT(error_of<diagnostic_msgs::msg::DiagnosticStatus>("{level: 256}"), HasSubstr("level"));
}

TEST(MessageSchema, MarkerSchemaMatchesJazzy) {
  const std::string schema = schema_text(describe<visualization_msgs::msg::Marker>());
  EXPECT_THAT(schema, HasSubstr("int32 MESH_RESOURCE=10\n"));
  EXPECT_THAT(schema, HasSubstr("int32 DELETEALL=3\n"));
  EXPECT_THAT(schema,
              HasSubstr("std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
                        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
                        "builtin_interfaces/Duration lifetime\nbool frame_locked\n"
                        "geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\n"
                        "string texture_resource\nsensor_msgs/CompressedImage texture\n"
                        "visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n"
                        "string mesh_resource\nvisualization_msgs/MeshFile mesh_file\n"
                        "bool mesh_use_embedded_materials\n"));
}

}  // namespace
}  // namespace doppel
