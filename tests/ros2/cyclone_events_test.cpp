// The calls of a twin's service as a ROS 2 process on Cyclone DDS receives them.

#include <events.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "cyclone_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

using Event = std_srvs_srv_dds__Trigger_Event_;
constexpr int kRequestReceived = 1, kResponseSent = 2;  // service_msgs/msg/ServiceEventInfo

TEST(CycloneEvents, RequestAndItsResponseAreReceived) {
  TwinProcess twin({"--ros-args", "-p", "gazebo:service_introspection:=contents"});
  CyclonePeer peer(own_domain());
  auto events = peer.subscribe(CYCLONE_TYPE(std_srvs, srv, Trigger_Event),
                               "rt/controller_manager/reset_emergency_stop/_service_event");
  // Repeated until this peer is known to the twin: events are volatile.
  std::unique_ptr<Process> client;
  const auto call_again = [&] {
    if (client != nullptr && client->running()) return;
    client = std::make_unique<Process>(
        std::vector<std::string>{doppel_program(), "--remote", "service", "call",
                                 "/controller_manager/reset_emergency_stop", "std_srvs/srv/Trigger"},
        twin.variables(), twin.folder() / "client");
  };
  std::int64_t sequence_number = -1;
  EXPECT_TRUE(eventually([&] {
    call_again();
    return events.take([&](const Event& event) {
      EXPECT_TRUE(std::any_of(std::begin(event.info_.client_gid_), std::end(event.info_.client_gid_),
                              [](std::uint8_t byte) { return byte != 0; }));
      if (event.info_.event_type_ == kRequestReceived) {
        EXPECT_EQ(event.request_._length, 1U);
        EXPECT_EQ(event.response_._length, 0U);
        sequence_number = event.info_.sequence_number_;
        return false;
      }
      EXPECT_EQ(event.info_.event_type_, kResponseSent);
      EXPECT_EQ(event.request_._length, 0U);
      EXPECT_EQ(event.response_._length, 1U);
      EXPECT_TRUE(event.response_._length == 1 && event.response_._buffer[0].message_ != nullptr);
      return event.info_.sequence_number_ == sequence_number;
    });
  })) << twin.output();
}

}  // namespace
}  // namespace doppel::ros2_testing
