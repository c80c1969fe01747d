#pragma once
// A bridge for tests: the test is the loop, the network is in memory.

#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/names.h"
#include "doppel/ros/network/test/fake_network.h"

namespace doppel::ros2 {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std_msgs::msg::Float64;
using test::FakeNetwork;

constexpr const char* kFloat = "std_msgs/msg/Float64";

inline EndpointSpec topic_spec(std::string_view topic, std::string_view type = kFloat, QosProfile qos = {}) {
  return {.topic = dds_name(NameKind::topic, topic), .type = dds_type(type), .type_hash = "", .qos = qos};
}

// A bus with its bridge, whose loop is this thread, and another participant.
class BridgeTest : public ::testing::Test {
 protected:
  BridgeTest() {
    log.add_sink([this](const LogLine& line) {
      const std::lock_guard lock(mutex);
      said.push_back(line.text);
    });
  }
  void start(BridgeOptions options = {}) {
    bridge.emplace(bus, std::move(options), log,
                   [this](const auto&, auto on_activity) { return network.join(std::move(on_activity)); });
  }
  // Runs the loop until the condition holds.
  template <class Condition>
  bool comes_true(const Condition& condition) {
    const auto end = steady_clock::now() + std::chrono::seconds(10);
    while (steady_clock::now() < end) {
      bus.spin();
      if (condition()) return true;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return false;
  }
  // Long enough for anything that must not happen.
  void run_for(milliseconds time) {
    const auto end = steady_clock::now() + time;
    comes_true([end] { return steady_clock::now() >= end; });
  }
  [[nodiscard]] std::vector<EndpointInfo> endpoints(std::string_view topic) const {
    auto all = peer->endpoints();
    std::erase_if(all, [&](const EndpointInfo& info) {
      return info.is_own || info.topic != dds_name(NameKind::topic, topic);
    });
    return all;
  }
  [[nodiscard]] bool is_heard(std::string_view topic) const {
    return std::ranges::any_of(bus.topics(), [&](const TopicInfo& info) {
      return info.name == topic && std::ranges::any_of(info.subscribers, [](const doppel::EndpointInfo& end) {
               return end.edge == "/_ros2";
             });
    });
  }
  std::vector<double> take_all(Reader& reader) {
    std::vector<double> values;
    Sample sample;
    Float64 message;
    while (reader.take(sample)) {
      if (from_cdr(sample.cdr, message)) values.push_back(message.data);
    }
    return values;
  }

  FakeNetwork network;
  Bus bus;
  doppel::Node node{bus, "/arm"};
  std::mutex mutex;
  std::vector<std::string> said;
  Log log;
  std::unique_ptr<Participant> peer = network.join([] {});
  std::optional<Bridge> bridge;
};

}  // namespace doppel::ros2
