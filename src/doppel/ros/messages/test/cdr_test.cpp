// CDR against bytes written by hand from the specification, and the handling of malformed bytes.

#include <gtest/gtest.h>

#include <random>

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "messages_testing.h"
#include "struct_codecs.h"

namespace doppel {
namespace {

using messages_testing::hex;
using messages_testing::new_seed;
using messages_testing::Wide;

sensor_msgs::msg::JointState joint_state() {
  sensor_msgs::msg::JointState state;
  state.header.stamp = {1, 2};
  state.header.frame_id = "ab";
  state.name = {"Revolute 2", ""};
  state.position = {1.0, -2.0};
  state.effort = {0.5};
  return state;
}
const char* const kJointState =
    "00 01 00 00 "
    "01 00 00 00 02 00 00 00 "  // stamp
    "03 00 00 00 61 62 00 00 "  // "ab", one byte of padding
    "02 00 00 00 "              // two names
    "0b 00 00 00 52 65 76 6f 6c 75 74 65 20 32 00 00 "
    "01 00 00 00 00 00 00 00 "  // "", three bytes of padding
    "02 00 00 00 "              // at 44: two positions; then padding up to 48
    "00 00 00 00 00 00 f0 3f 00 00 00 00 00 00 00 c0 "
    "00 00 00 00 "  // no velocities, hence no alignment to eight
    "01 00 00 00 00 00 00 00 00 00 e0 3f";

geometry_msgs::msg::TransformStamped transform() {
  geometry_msgs::msg::TransformStamped t;
  t.header.stamp = {-1, 500000000};
  t.header.frame_id = "world";
  t.child_frame_id = "tip";
  t.transform.translation = {1, 2, 3};
  return t;
}
const char* const kTransform =
    "00 01 00 00 "
    "ff ff ff ff 00 65 cd 1d "
    "06 00 00 00 77 6f 72 6c 64 00 00 00 "
    "04 00 00 00 74 69 70 00 "  // ends at 28
    "00 00 00 00 "              // padding up to 32
    "00 00 00 00 00 00 f0 3f 00 00 00 00 00 00 00 40 00 00 00 00 00 00 08 40 "
    "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 f0 3f";

trajectory_msgs::msg::JointTrajectory trajectory() {
  trajectory_msgs::msg::JointTrajectory t;
  t.joint_names = {"j"};
  t.points.resize(1);
  t.points[0].positions = {1};
  t.points[0].time_from_start = {3, 7};
  return t;
}
const char* const kTrajectory =
    "00 01 00 00 "
    "00 00 00 00 00 00 00 00 "
    "01 00 00 00 00 00 00 00 "  // frame_id "", padding up to 16
    "01 00 00 00 02 00 00 00 6a 00 00 00 "
    "01 00 00 00 "              // at 28: one point
    "01 00 00 00 00 00 00 00 "  // at 32: one position; padding up to 40
    "00 00 00 00 00 00 f0 3f "
    "00 00 00 00 00 00 00 00 00 00 00 00 "
    "03 00 00 00 07 00 00 00";

controller_manager_msgs::srv::ListControllers::Response controllers() {
  controller_manager_msgs::srv::ListControllers::Response response;
  auto& c = response.controller.emplace_back();
  c.name = "jtc";
  c.state = "active";
  c.type = "t";
  c.update_rate = 100;
  c.claimed_interfaces = {"a/position"};
  c.is_chained = true;
  c.chain_connections.push_back({"x", {"y"}});
  return response;
}
const char* const kControllers =
    "00 01 00 00 "
    "01 00 00 00 "
    "04 00 00 00 6a 74 63 00 "
    "07 00 00 00 61 63 74 69 76 65 00 00 "
    "02 00 00 00 74 00 "  // ends at 30
    "00 00 "              // is_async, padding up to 32
    "64 00 00 00 "        // 100 Hz, padding up to 36
    "01 00 00 00 0b 00 00 00 61 2f 70 6f 73 69 74 69 6f 6e 00 00 "
    "00 00 00 00 00 00 00 00 "  // no required interfaces
    "00 01 00 00 "              // is_chainable, is_chained, padding
    "00 00 00 00 00 00 00 00 "
    "01 00 00 00 02 00 00 00 78 00 00 00 01 00 00 00 02 00 00 00 79 00";

template <class M>
void expect_golden(const M& message, const char* bytes) {
  const Bytes golden = hex(bytes);
  EXPECT_EQ(messages_testing::show(to_cdr(message)), messages_testing::show(golden));
  EXPECT_EQ(cdr_size(message), golden.size());
  M read;
  ASSERT_TRUE(from_cdr(golden, read)) << from_cdr(golden, read).why();
  EXPECT_EQ(to_cdr(read), golden);
  for (std::size_t size = 0; size < golden.size(); ++size) {
    M cut;
    const Bytes part(golden.begin(), golden.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(from_cdr(part, cut))
        << "expected an error for data cut to " << size << " of " << golden.size();
  }
  Bytes longer = golden;
  longer.resize(golden.size() + 8);
  EXPECT_FALSE(from_cdr(longer, read));
  Bytes small(golden.size() - 1);
  EXPECT_EQ(write_cdr(message, small), 0U);
}

TEST(Cdr, BytesMatchGoldenVectors) {
  expect_golden(joint_state(), kJointState);
  expect_golden(transform(), kTransform);
  expect_golden(trajectory(), kTrajectory);
  expect_golden(controllers(), kControllers);
}

TEST(Cdr, EmptyMessageIsOneByte) {
  EXPECT_EQ(to_cdr(std_srvs::srv::Trigger::Request{}), hex("00 01 00 00 00"));
  std_srvs::srv::Trigger::Request request;
  EXPECT_FALSE(from_cdr(hex("00 01 00 00"), request));
}

TEST(Cdr, BigEndianIsReadToo) {
  trajectory_msgs::msg::JointTrajectoryPoint point;
  ASSERT_TRUE(from_cdr(hex("00 00 00 00 00 00 00 01 00 00 00 00 3f f0 00 00 00 00 00 00 "
                           "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 03 00 00 00 07"),
                       point));
  EXPECT_EQ(point.positions, std::vector<double>{1.0});
  EXPECT_EQ(point.time_from_start.sec, 3);
  EXPECT_EQ(point.time_from_start.nanosec, 7U);
}

TEST(Cdr, PaddingToFourBytesIsAccepted) {
  std_msgs::msg::Bool flag;
  EXPECT_TRUE(from_cdr(hex("00 01 00 03 01 00 00 00"), flag));
  EXPECT_TRUE(flag.data);
  EXPECT_FALSE(from_cdr(hex("00 01 00 00 01 00"), flag));
  EXPECT_FALSE(from_cdr(hex("00 01 00 00 01 00 00 00 00"), flag));
}

TEST(Cdr, MalformedBytesAreRefusedWithField) {
  std_msgs::msg::Bool flag;
  EXPECT_FALSE(from_cdr(hex("00 01 00 00 02"), flag));
  EXPECT_FALSE(from_cdr(hex("00 07 00 00 01"), flag));
  sensor_msgs::msg::JointState state;
  // Four thousand million names in no bytes: rejected before any memory is allocated.
  const Status status =
      from_cdr(hex("00 01 00 00 00 00 00 00 00 00 00 00 01 00 00 00 00 00 00 00 ff ff ff ff"), state);
  ASSERT_FALSE(status);
  EXPECT_NE(status.why().find("'name'"), std::string::npos) << status.why();
  EXPECT_NE(status.why().find("sensor_msgs/msg/JointState"), std::string::npos) << status.why();
  std_msgs::msg::String text;
  EXPECT_FALSE(from_cdr(hex("00 01 00 00 03 00 00 00 61 62"), text));
}

TEST(Cdr, OtherEncapsulationIsRefused) {
  const auto why = [](const char* header) {
    std_msgs::msg::Bool flag;
    return from_cdr(hex(std::string(header) + " 01"), flag).why();
  };
  EXPECT_EQ(why("00 00 00 00"), "");
  EXPECT_EQ(why("00 01 00 00"), "");
  EXPECT_EQ(why("00 01 ff ff"), "") << "expected success: Fast CDR ignores the options, too";
  for (const char* header : {"00 02 00 00", "00 03 00 00"})
    EXPECT_NE(why(header).find("parameter list"), std::string::npos) << header;
  for (const char* header :
       {"00 06 00 00", "00 07 00 00", "00 08 00 00", "00 09 00 00", "00 0a 00 00", "00 0b 00 00"})
    EXPECT_NE(why(header).find("XCDR version 2"), std::string::npos) << header;
  for (const char* header : {"00 04 00 00", "00 0c 00 00", "00 ff 00 00", "01 01 00 00", "80 00 00 00"})
    EXPECT_NE(why(header).find("encapsulation"), std::string::npos) << header;
  EXPECT_NE(why("00 01").find("four bytes"), std::string::npos) << why("00 01");
}

// Fast CDR's writers always send the NUL; its readers accept a string without one, and one of no bytes at
// all.
TEST(Cdr, StringsAreReadAsByFastCdr) {
  const auto read = [](const char* bytes) {
    std_msgs::msg::String text{"before"};
    return from_cdr(hex(bytes), text) ? text.data : "refused";
  };
  EXPECT_EQ(read("00 01 00 00 03 00 00 00 61 62 00"), "ab");
  EXPECT_EQ(read("00 01 00 00 02 00 00 00 61 62"), "ab");
  EXPECT_EQ(read("00 01 00 00 01 00 00 00 00"), "");
  EXPECT_EQ(read("00 01 00 00 00 00 00 00"), "");
  EXPECT_EQ(read("00 01 00 00 03 00 00 00 61 00 62"), std::string("a\0b", 3));
  EXPECT_EQ(read("00 01 00 00 04 00 00 00 61 62 00"), "refused");
  EXPECT_EQ(read("00 01 00 00 ff ff ff ff 61 62 00"), "refused");
  EXPECT_EQ(read("00 00 00 00 00 00 00 03 61 62 00"), "ab") << "expected big-endian data to be read";
}

TEST(Cdr, WideTextTakesFourBytesPerUnit) {
  const Bytes bytes = hex("00 01 00 00 02 00 00 00 e4 00 00 00 41 00 00 00 42 00");
  EXPECT_EQ(messages_testing::show(to_cdr(Wide{u"\u00e4A", u'B'})), messages_testing::show(bytes));
  EXPECT_EQ(cdr_size(Wide{u"\u00e4A", u'B'}), bytes.size());
  Wide wide;
  ASSERT_TRUE(from_cdr(bytes, wide));
  EXPECT_EQ(wide.text, u"\u00e4A");
  EXPECT_EQ(wide.unit, u'B');
  std::string yaml;
  ASSERT_TRUE(type_support<Wide>().cdr_to_yaml(bytes, yaml));
  EXPECT_EQ(yaml,
            "text: \xC3\xA4"
            "A\nunit: 66\n");
  EXPECT_FALSE(from_cdr(hex("00 01 00 00 01 00 00 00 00 00 01 00 42 00"), wide))
      << "expected an error: not valid UTF-16";
  EXPECT_FALSE(from_cdr(hex("00 01 00 00 ff ff ff 7f e4 00 00 00 42 00"), wide));
}

TEST(Cdr, ActionTypesAreNamedAsByRosidl) {
  ASSERT_NE(find_type("control_msgs/action/FollowJointTrajectory_FeedbackMessage"), nullptr);
  ASSERT_NE(find_service("control_msgs/action/FollowJointTrajectory_SendGoal"), nullptr);
  ASSERT_NE(find_service("control_msgs/action/FollowJointTrajectory_GetResult"), nullptr);
  ASSERT_NE(find_action("control_msgs/FollowJointTrajectory"), nullptr);
  EXPECT_EQ(find_type("sensor_msgs/JointState"), find_type("sensor_msgs/msg/JointState"));
  EXPECT_EQ(find_service("std_srvs/Trigger"), find_service("std_srvs/srv/Trigger"));
  EXPECT_EQ(find_type("JointState"), nullptr);
}

TEST(Cdr, EveryTypeRoundTripsThroughYaml) {
  const unsigned seed = new_seed();
  std::mt19937 random(seed);
  for (const TypeSupport* type : messages_testing::all_types()) {
    for (int round = 0; round < 20; ++round) {
      const Bytes bytes = messages_testing::random_message(*type->description(), random);
      Bytes recoded, from_yaml;
      std::string yaml, json;
      ASSERT_TRUE(type->recode(bytes, recoded)) << type->name << " seed " << seed;
      ASSERT_EQ(recoded, bytes) << type->name << " seed " << seed;
      ASSERT_TRUE(type->cdr_to_yaml(bytes, yaml)) << type->name << " seed " << seed;
      ASSERT_TRUE(type->cdr_to_json(bytes, json));
      const Status status = type->yaml_to_cdr(yaml, from_yaml);
      ASSERT_TRUE(status) << type->name << " seed " << seed << ": " << status.why() << "\n" << yaml;
      ASSERT_EQ(messages_testing::show(from_yaml), messages_testing::show(bytes))
          << type->name << " seed " << seed << "\n"
          << yaml;
    }
  }
}

TEST(Cdr, EveryTruncationIsRefused) {
  const unsigned seed = new_seed();
  std::mt19937 random(seed);
  for (const TypeSupport* type : messages_testing::all_types()) {
    const Bytes bytes = messages_testing::random_message(*type->description(), random);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      Bytes recoded;
      std::string yaml;
      const std::span<const std::byte> cut(bytes.data(), size);
      ASSERT_FALSE(type->recode(cut, recoded)) << type->name << " cut to " << size << " seed " << seed;
      ASSERT_FALSE(type->cdr_to_yaml(cut, yaml)) << type->name << " cut to " << size << " seed " << seed;
    }
  }
}

TEST(Cdr, RandomBytesAreRefused) {
  const unsigned seed = new_seed();
  std::mt19937 random(seed);
  for (const TypeSupport* type : messages_testing::all_types()) {
    for (int round = 0; round < 30; ++round) {
      Bytes bytes = messages_testing::random_message(*type->description(), random);
      for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
      Bytes recoded;
      std::string json;
      ASSERT_EQ(type->recode(bytes, recoded).ok(), type->cdr_to_json(bytes, json).ok())
          << type->name << " seed " << seed;
    }
  }
}

// Two independent readers and writers: the templates over the fields of structs, and the code over
// descriptions.
TEST(Cdr, StructCodecsAgreeWithDescriptions) {
  const unsigned seed = new_seed();
  std::mt19937 random(seed);
  for (const auto& [type, recode_struct] : messages_testing::struct_codecs()) {
    for (int round = 0; round < 100; ++round) {
      Bytes bytes = messages_testing::random_message(*type->description(), random);
      Bytes by_struct, by_description;
      ASSERT_TRUE(recode_struct(bytes, by_struct)) << type->name << " seed " << seed;
      ASSERT_EQ(by_struct, bytes) << type->name << " seed " << seed;
      for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
      bytes.resize(bytes.size() - random() % 3);
      const Status read = recode_struct(bytes, by_struct), described = type->recode(bytes, by_description);
      ASSERT_EQ(read.ok(), described.ok()) << type->name << " seed " << seed;
      if (!read) continue;
      ASSERT_EQ(by_struct.size(), by_description.size()) << type->name << " seed " << seed;
    }
  }
}

}  // namespace
}  // namespace doppel
