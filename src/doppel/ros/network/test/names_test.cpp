#include "doppel/ros/network/names.h"

#include <gtest/gtest.h>

#include "doppel/ros/network/qos_profile.h"

namespace doppel::ros2 {
namespace {

TEST(RosNames, NamesRoundTripToWire) {
  EXPECT_EQ(dds_name(NameKind::topic, "/joint_states"), "rt/joint_states");
  EXPECT_EQ(dds_name(NameKind::request, "/a/b"), "rq/a/bRequest");
  EXPECT_EQ(dds_name(NameKind::reply, "/a/_action/get_result"), "rr/a/_action/get_resultReply");
  for (const NameKind kind : {NameKind::topic, NameKind::request, NameKind::reply}) {
    const auto back = ros_name(dds_name(kind, "/ns/name"));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->kind, kind);
    EXPECT_EQ(back->name, "/ns/name");
  }
}

TEST(RosNames, ForeignTopicHasNoRosName) {
  for (const char* name : {"", "rt", "rt/", "joint_states", "ros_discovery_info", "rq/a", "rr/aRequest",
                           "rq/Request", "rtx/a", "rs/a", "rt/a\x1b[2J", "rt/a\n", "rt/\xc2\x9b"})
    EXPECT_FALSE(ros_name(name)) << name;
}

TEST(RosNames, TypesRoundTripToWire) {
  EXPECT_EQ(dds_type("sensor_msgs/msg/JointState"), "sensor_msgs::msg::dds_::JointState_");
  EXPECT_EQ(dds_type("std_srvs/srv/Trigger_Request"), "std_srvs::srv::dds_::Trigger_Request_");
  for (const char* type : {"sensor_msgs/msg/JointState", "std_srvs/srv/Trigger_Response",
                           "control_msgs/action/FollowJointTrajectory_SendGoal_Request"})
    EXPECT_EQ(ros_type(dds_type(type)), type);
  for (const char* type : {"", "JointState", "a::b::C_", "a::dds_::", "::dds_::B_", "a::dds_::_",
                           "a::dds_::B", "a::dds_::\x1b_"})
    EXPECT_FALSE(ros_type(type)) << type;
}

TEST(Qos, WeakerOfferIsIncompatible) {
  EXPECT_EQ(incompatibility(default_qos(), default_qos()), "");
  EXPECT_EQ(incompatibility(default_qos(), sensor_data_qos()), "");
  EXPECT_EQ(incompatibility(latched_qos(), default_qos()), "");
  EXPECT_EQ(incompatibility(sensor_data_qos(), default_qos()),
            "reliability: best effort is offered, reliable is requested");
  EXPECT_EQ(incompatibility(default_qos(), latched_qos()),
            "durability: volatile is offered, transient local is requested");
  QosProfile every_second;
  every_second.deadline = std::chrono::seconds(1);
  EXPECT_EQ(incompatibility(default_qos(), every_second), "deadline: infinite is offered, 1 s is requested");
  EXPECT_EQ(incompatibility(every_second, default_qos()), "");
}

TEST(Qos, LastIncompatiblePolicyIsNamed) {
  EXPECT_EQ(incompatible_policy(default_qos(), default_qos()), "");
  QosProfile strict = latched_qos();
  EXPECT_EQ(incompatible_policy(default_qos(), strict), "DURABILITY_QOS_POLICY");
  strict.deadline = std::chrono::seconds(1);
  EXPECT_EQ(incompatible_policy(default_qos(), strict), "DEADLINE_QOS_POLICY");
  strict.lease = std::chrono::seconds(1);
  EXPECT_EQ(incompatible_policy(default_qos(), strict), "LIVELINESS_QOS_POLICY");
  EXPECT_EQ(incompatible_policy(sensor_data_qos(), strict), "RELIABILITY_QOS_POLICY");
}

}  // namespace
}  // namespace doppel::ros2
