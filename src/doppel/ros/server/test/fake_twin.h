#pragma once
// A bus with its own loop for tests: one node that publishes, receives messages, and has services and
// parameters.

#include <atomic>
#include <thread>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel::test {

class FakeTwin {
 public:
  // `padding`: bytes in the name of the single joint of /joint_states, to make messages large.
  explicit FakeTwin(std::size_t padding = 0) : padding_(padding) {
    thread_ = std::thread([this] { run(); });
    while (!running_) std::this_thread::yield();
  }
  ~FakeTwin() {
    running_ = false;
    thread_.join();
  }

  [[nodiscard]] Bus& bus() { return bus_; }
  [[nodiscard]] int received() const { return received_; }
  [[nodiscard]] double last_value() const { return last_value_; }
  // The loop's thread.
  void add_parameters(int count) {
    for (int i = 0; i < count; ++i) node_->parameters().declare("more.p" + std::to_string(i), 1.0 * i);
  }
  // Runs a task on the loop's thread and waits for it.
  void on_loop(std::function<void()> task) {
    std::atomic<bool> done = false;
    bus_.post([&] {
      task();
      done = true;
    });
    while (!done) std::this_thread::yield();
  }

 private:
  void run() {
    Node node(bus_, "/arm");
    node_ = &node;
    const auto states = node.advertise<sensor_msgs::msg::JointState>("/joint_states");
    const auto clock = node.advertise<rosgraph_msgs::msg::Clock>("/clock");
    const auto about =
        node.advertise<std_msgs::msg::String>("/robot_description", {.depth = 1, .latched = true});
    node.subscribe<std_msgs::msg::Float64>("/command", [this](const std_msgs::msg::Float64& message) {
      last_value_ = message.data;
      ++received_;
    });
    node.serve<std_srvs::srv::SetBool>("~/enable", [](const auto& request, const auto& respond) {
      respond({.success = request.data, .message = request.data ? "on" : "off"});
    });
    node.serve<std_srvs::srv::Trigger>("~/never", [](const auto&, const auto&) {});
    node.parameters().declare("rate", std::int64_t{100}, {.description = "Hz"});
    node.parameters().declare("gains.p", 1.0);
    node.parameters().declare("name", std::string("arm"), {.read_only = true});
    about.publish({.data = "<robot/>"}, time_from_nanoseconds(0));
    sensor_msgs::msg::JointState state;
    state.name = {"Revolute 1" + std::string(padding_, 'x')};
    state.position = {0};
    running_ = true;
    for (Time now{}; running_; now += std::chrono::milliseconds(1)) {
      bus_.set_now(now);
      bus_.spin();
      state.header.stamp = to_time_msg(now);
      state.position[0] = to_seconds(now);
      states.publish(state, now);
      clock.publish({.clock = to_time_msg(now)}, now);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }

  const std::size_t padding_;
  Bus bus_;
  Node* node_ = nullptr;
  std::atomic<bool> running_ = false;
  std::atomic<int> received_ = 0;
  std::atomic<double> last_value_ = 0;
  std::thread thread_;
};

}  // namespace doppel::test
