// A ROS 2 process to be started on another network or with another kind of end:
//
//   network_probe DOMAIN [--localhost | --subnet] [--peer ADDRESS]... [--lease SECONDS] hear|hold
//
// The range is as in fast_peer.h; without one, loopback alone.
//
// hear: exits with 0 when a joint state has arrived and a service has answered, otherwise with 1.
// hold: reads joint states until it is killed.

#include <controller_manager_msgs.h>
#include <sensor_msgs.h>

#include <cstdio>
#include <cstring>

#include "fast_peer.h"

namespace doppel::ros2_testing {
namespace {

int receive(FastPeer& peer) {
  using namespace controller_manager_msgs::srv::dds_;  // NOLINT
  auto states = peer.subscribe<sensor_msgs::msg::dds_::JointState_>("rt/joint_states");
  if (!states.next().has_value()) {
    std::puts("no joint state came");
    return 1;
  }
  ServiceClient<ListControllers_Request_, ListControllers_Response_> list(
      peer, "/controller_manager/list_controllers");
  const auto answer = list.call({});
  if (!answer.has_value()) {
    std::puts("joint states came, but no service answered");
    return 1;
  }
  std::printf("heard of %zu controllers\n", answer->controller_().size());
  return 0;
}

int hold(FastPeer& peer) {
  auto states = peer.subscribe<sensor_msgs::msg::dds_::JointState_>("rt/joint_states");
  for (;;) states.next();
}

int run(int count, char** words) {
  FastPeer::Options options;
  for (int i = 2; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--localhost") options.reach = Reach::localhost;
    if (word == "--subnet") options.reach = Reach::subnet;
    if (word == "--peer" && i + 1 < count) options.peers.emplace_back(words[++i]);
    if (word == "--lease" && i + 1 < count) {
      options.lease_seconds = std::atof(words[++i]);
      options.announce_seconds = options.lease_seconds / 4;
    }
  }
  if (count < 3) return 2;
  FastPeer peer(std::atoi(words[1]), options);
  return std::strcmp(words[count - 1], "hear") == 0 ? receive(peer) : hold(peer);
}

}  // namespace
}  // namespace doppel::ros2_testing

int main(int count, char** words) {
  return doppel::ros2_testing::run(count, words);
}
