// What a hostile process can do to the twin: only increment a counter (/diagnostics, "doppel: ros2 network").

#include <control_msgs.h>
#include <diagnostic_msgs.h>
#include <gtest/gtest.h>
#include <rcl_interfaces.h>
#include <sensor_msgs.h>
#include <std_msgs.h>
#include <trajectory_msgs.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <random>

#include "fast_twin_test.h"
#include "hostile_datagrams.h"

namespace doppel::ros2_testing {
namespace {

using diagnostic_msgs::msg::dds_::DiagnosticArray_;
using sensor_msgs::msg::dds_::JointState_;
using trajectory_msgs::msg::dds_::JointTrajectory_;

// Arbitrary bytes under the name of any type, sent unchanged, including the encapsulation header.
class RawType : public PeerType {
 public:
  explicit RawType(const char* name) : PeerType(name, 1024) {}

 private:
  bool put(const void* data, Payload& payload) const override {
    const auto& bytes = *static_cast<const Octets*>(data);
    std::copy(bytes.begin(), bytes.end(), payload.data);
    payload.length = static_cast<std::uint32_t>(bytes.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  bool get(const Payload&, void*) const override { return false; }
  [[nodiscard]] std::uint32_t size_of(const void* data) const override {
    return static_cast<std::uint32_t>(static_cast<const Octets*>(data)->size());
  }
  [[nodiscard]] void* make() const override { return new Octets; }
  void destroy(void* data) const override { delete static_cast<Octets*>(data); }
};

// All of these claim to be a JointTrajectory or a list of names; none is valid.
std::vector<Octets> malformed_bodies() {
  std::vector<Octets> all = {
      {0, 1, 0, 0},                                  // nothing after the header
      {0, 1, 0, 0, 1, 2},                            // ends within a number
      {0, 3, 0, 0, 0, 0, 0, 0},                      // a parameter list, not CDR
      {0, 7, 0, 0, 0, 0, 0, 0},                      // XCDR version 2
      {0x77, 0x77, 0x77, 0x77, 0, 0, 0, 0},          // an encapsulation that does not exist
      {0, 1, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0},  // a length that exceeds any memory
      {0, 1, 0, 0, 255, 255, 255, 127, 0, 0, 0, 0},  // a length that fits into an int
      {0, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0},  // the other byte order
  };
  Octets names = {0, 1, 0, 0, 0, 0, 0, 0, 0, 0,
                  0, 0, 1, 0, 0, 0, 0, 0, 0, 0};  // stamp, frame_id, joint_names
  names[17] = 1;                                  // 256 names, none of which follows
  all.push_back(names);
  Octets endless = {0, 1, 0, 0, 9,   0,   0,   0,   9, 0, 0, 0,
                    4, 0, 0, 0, 'a', 'b', 'c', 'd', 0, 0, 0, 0};  // no NUL
  all.push_back(endless);
  Octets ones(100'000, 1);
  ones[0] = 0;
  all.push_back(ones);
  return all;
}

constexpr const char* kTrajectoryTopic = "rt/omarm_arm_controller/joint_trajectory";
constexpr const char* kTrajectoryType = "trajectory_msgs::msg::dds_::JointTrajectory_";
const std::string kGetParameters = "/omarm_arm_controller/get_parameters";

class HostileNetwork : public FastTwinTest {
 protected:
  using ParameterClient = ServiceClient<rcl_interfaces::srv::dds_::GetParameters_Request_,
                                        rcl_interfaces::srv::dds_::GetParameters_Response_>;
  // The number in /diagnostics under that key, from now on.
  std::int64_t counter(const std::string& key) {
    diagnostics.forget_all();
    std::int64_t value = -1;
    diagnostics.next([&](const DiagnosticArray_& message) {
      for (const auto& status : message.status_()) {
        if (status.name_() != "doppel: ros2 network") continue;
        for (const auto& entry : status.values_())
          if (entry.key_() == key) value = std::stoll(entry.value_());
      }
      return value >= 0;
    });
    return value;
  }
  Publisher<Octets> raw(const std::string& topic, const char* type) {
    return Publisher<Octets>(peer.writer(topic, dds::TypeSupport(new RawType(type)), {.depth = 100}));
  }
  // Each is sent after the previous one has been read: a reader of ROS 2's default profiles keeps ten, or
  // one.
  void expect_each_is_refused(Publisher<Octets>& bad) {
    const std::int64_t before = counter("rejected");
    std::int64_t sent = 0, refused = 0;
    for (const Octets& body : malformed_bodies()) {
      bad.publish(body);
      ++sent;
      // The first response may be in transit before the message is read, the second cannot.
      for (int i = 0; i < 2; ++i) ASSERT_NO_FATAL_FAILURE(expect_parameters_are_reported(witness));
    }
    EXPECT_TRUE(eventually([&] { return (refused = counter("rejected") - before) >= sent; }))
        << "expected all to be rejected; " << refused << " of " << sent;
    EXPECT_EQ(refused, sent);
  }
  // The controller reads commands with best effort, as in Jazzy, so it receives nothing from a participant
  // that the twin has not discovered. Discovery reports writers in order: once a request of a peer is
  // answered, all its earlier endpoints have been discovered.
  static void expect_to_be_known(FastPeer& joining) {
    ParameterClient client(joining, kGetParameters);
    expect_parameters_are_reported(client);
  }
  // Simulated time continues, services answer, and the arm follows commands.
  void expect_twin_is_well() {
    ASSERT_TRUE(twin().process().running());
    FastPeer joining(own_domain());
    auto states = joining.subscribe<JointState_>("rt/joint_states");
    auto commands = joining.advertise<JointTrajectory_>(kTrajectoryTopic);
    ASSERT_TRUE(eventually([&] { return commands.matched() > 0; })) << "expected a new peer to be discovered";
    ASSERT_NO_FATAL_FAILURE(expect_to_be_known(joining));
    static double goal = 0.1;
    goal = 0.3 - goal;
    JointTrajectory_ trajectory;
    trajectory.joint_names_() = arm_joints();
    auto& point = trajectory.points_().emplace_back();
    point.positions_().assign(arm_joints().size(), goal);
    point.time_from_start_().nanosec_() = 300'000'000;
    commands.publish(trajectory);
    EXPECT_TRUE(states.next([&](const JointState_& state) {
      for (std::size_t i = 0; i < state.name_().size(); ++i)
        if (state.name_()[i] == "Revolute 1") return std::abs(state.position_()[i] - goal) < 0.01;
      return false;
    })) << "expected the arm to follow the command";
  }
  static void expect_parameters_are_reported(ParameterClient& client) {
    rcl_interfaces::srv::dds_::GetParameters_Request_ request;
    request.names_() = {"joints"};
    const auto answer = client.call(request);
    ASSERT_TRUE(answer.has_value()) << "expected a response from a service";
    ASSERT_EQ(answer->values_().size(), 1u);
    EXPECT_EQ(answer->values_()[0].string_array_value_(), arm_joints());
  }
  FastPeer good_neighbour{own_domain()};  // whose identity no test forges
  ParameterClient witness{good_neighbour, kGetParameters};
  Subscription<DiagnosticArray_> diagnostics = peer.subscribe<DiagnosticArray_>("rt/diagnostics");
};

TEST_F(HostileNetwork, MalformedMessagesAreCountedOnly) {
  auto bad = raw(kTrajectoryTopic, kTrajectoryType);
  ASSERT_TRUE(eventually([&] { return bad.matched() > 0; }));
  ASSERT_NO_FATAL_FAILURE(expect_to_be_known(peer));
  expect_each_is_refused(bad);
  expect_twin_is_well();
}

// A malformed request gets no response, as with ROS 2's servers, and does not affect the next one.
TEST_F(HostileNetwork, MalformedRequestsAreCountedOnly) {
  auto bad = raw("rq" + kGetParameters + "Request", "rcl_interfaces::srv::dds_::GetParameters_Request_");
  ASSERT_TRUE(eventually([&] { return bad.matched() > 0; }));
  expect_each_is_refused(bad);
  expect_twin_is_well();
}

TEST_F(HostileNetwork, AnotherTypeOnSameTopicIsNotMatched) {
  auto wrong_writer = peer.advertise<std_msgs::msg::dds_::String_>(kTrajectoryTopic);
  auto wrong_reader = peer.subscribe<std_msgs::msg::dds_::String_>("rt/joint_states");
  // Discovery reports writers in order, and readers as well: when these are matched, the two above have been
  // evaluated.
  auto right_writer = peer.advertise<JointTrajectory_>("rt/omarm_gripper_controller/joint_trajectory");
  auto right_reader = peer.subscribe<control_msgs::msg::dds_::DynamicJointState_>("rt/dynamic_joint_states");
  ASSERT_TRUE(eventually([&] { return right_writer.matched() > 0 && right_reader.matched() > 0; }));
  EXPECT_EQ(wrong_writer.matched(), 0);
  EXPECT_EQ(wrong_reader.matched(), 0);
  wrong_writer.publish({});
  expect_twin_is_well();
}

// A valid message with values that are not finite is rejected by the controller.
TEST_F(HostileNetwork, NanDoesNotMoveArm) {
  auto commands = peer.advertise<JointTrajectory_>(kTrajectoryTopic);
  ASSERT_TRUE(eventually([&] { return commands.matched() > 0; }));
  ASSERT_NO_FATAL_FAILURE(expect_to_be_known(peer));
  for (const double number : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    JointTrajectory_ trajectory;
    trajectory.joint_names_() = arm_joints();
    auto& point = trajectory.points_().emplace_back();
    point.positions_().assign(arm_joints().size(), number);
    point.time_from_start_().nanosec_() = 4'000'000'000;  // not a valid time either
    commands.publish(trajectory);
  }
  expect_twin_is_well();
}

TEST_F(HostileNetwork, VanishedPeerIsDropped) {
  std::int64_t before = counter("other participants");
  const auto is_unchanged_for_two_seconds = [&] {
    std::this_thread::sleep_for(std::chrono::seconds(2));
    const std::int64_t last = before;
    return (before = counter("other participants")) == last;
  };
  ASSERT_TRUE(eventually(is_unchanged_for_two_seconds)) << "the participants of earlier tests do not leave";
  const auto probe = std::filesystem::temp_directory_path() / ("doppel-probe-" + std::to_string(getpid()));
  Process vanishing({std::getenv("PROBE"), std::to_string(own_domain()), "--lease", "1", "hold"}, {}, probe);
  EXPECT_TRUE(eventually([&] { return counter("other participants") == before + 1; }));
  vanishing.kill();
  EXPECT_TRUE(eventually([&] { return counter("other participants") == before; }));
  std::filesystem::remove(probe);
  expect_twin_is_well();
}

// ---- datagrams that no DDS implementation has written

class Garbage {
 public:
  void send(int port, const Octets& bytes) const { socket_.send(port, bytes); }
  Octets noise(std::size_t most) {
    Octets bytes(random_() % (most + 1));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_());
    return bytes;
  }
  // An RTPS header, from an unknown or a known participant, and submessages whose lengths are more often
  // right than wrong.
  Octets nearly_rtps(const GUID_t& name) {
    Octets bytes = {'R', 'T', 'P', 'S', 2, 3, 1, 15};
    for (int i = 0; i < 12; ++i)
      bytes.push_back(random_() % 2 == 0 ? static_cast<std::uint8_t>(random_()) : name.guidPrefix.value[i]);
    if (random_() % 2 == 0) std::copy_n(name.guidPrefix.value, 12, bytes.begin() + 8);
    for (std::size_t count = random_() % 4 + 1; count > 0; --count) submessage(bytes);
    return bytes;
  }

 private:
  void submessage(Octets& bytes) {
    constexpr std::uint8_t kKinds[] = {0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0d,
                                       0x0e, 0x0f, 0x12, 0x13, 0x15, 0x16, 0x80};
    constexpr std::uint8_t kEntities[][4] = {{0, 1, 0, 0xc2}, {0, 1, 0, 0xc7}, {0, 0, 3, 0xc2},
                                             {0, 0, 3, 0xc7}, {0, 0, 4, 0xc2}, {0, 0, 4, 0xc7},
                                             {0, 2, 0, 0xc2}, {0, 0, 1, 0x03}};
    Octets body = noise(200);
    if (body.size() >= 12 && random_() % 3 != 0) {  // with DATA's reader and writer
      std::copy_n(kEntities[random_() % std::size(kEntities)], 4, body.begin() + 4);
      std::copy_n(kEntities[random_() % std::size(kEntities)], 4, body.begin() + 8);
      body[2] = 16;  // octets to inline QoS
      body[3] = 0;
    }
    const std::size_t declared = random_() % 4 == 0 ? random_() % 65536 : body.size();
    bytes.push_back(kKinds[random_() % std::size(kKinds)]);
    bytes.push_back(static_cast<std::uint8_t>(random_() % 2 == 0 ? random_() : 1 | (random_() & 6)));
    bytes.push_back(static_cast<std::uint8_t>(declared));
    bytes.push_back(static_cast<std::uint8_t>(declared >> 8));
    bytes.insert(bytes.end(), body.begin(), body.end());
  }
  DatagramSocket socket_;
  std::mt19937 random_{2024};
};

TEST_F(HostileNetwork, GarbageOnPortsIsIgnored) {
  const auto [guid, seen] = twin_as_seen_by(peer);
  const std::int64_t before = counter("rejected datagrams");
  Garbage garbage;
  for (int i = 0; i < 1000; ++i) {
    for (const int port : seen.ports) {
      garbage.send(port, garbage.noise(1400));
      garbage.send(port, garbage.nearly_rtps(i % 2 == 0 ? peer.guid() : guid));
    }
    // This also gives the twin time to read its sockets.
    if (i % 100 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_parameters_are_reported(witness));
    }
    ASSERT_TRUE(twin().process().running());
  }
  EXPECT_TRUE(eventually([&] { return counter("rejected datagrams") > before; }));
  expect_twin_is_well();
}

}  // namespace
}  // namespace doppel::ros2_testing
