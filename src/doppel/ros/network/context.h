#pragma once
// The client library for user programs in a ROS 2 graph, without an installation of ROS: a Context has the
// participant and the thread of its nodes (node.h). See examples/03_controller_node and docs/ros2_client.md.
//
//   doppel::ros2::Context context(argc, argv);
//   doppel::ros2::Node node(context, "talker");
//   auto chatter = node.create_publisher<doppel::std_msgs::msg::String>("chatter");
//   const auto timer = node.create_wall_timer(1s, [&] { chatter.publish({"hello"}); });
//   context.spin();
//
// A context is used on the thread that creates it; callbacks are executed there while it spins. An exception
// in a callback leaves the spinning function; spinning in a callback throws std::logic_error.

#include <chrono>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/environment.h"

namespace doppel::ros2 {

struct ContextOptions {
  ParticipantOptions network;  // from_environment() reads them
  RosArguments arguments;      // take_ros_arguments() reads them
  bool catch_signals = true;   // SIGINT and SIGTERM end ok()
  bool log_to_stderr = true;
};

// Runs as long as the object exists and its context spins. Missed calls are skipped.
class DOPPEL_API Timer {
 public:
  using Clock = std::chrono::steady_clock;
  // `by_wall`: in wall-clock time, else in ROS time, which may be simulated.
  Timer(std::chrono::nanoseconds period, bool by_wall, Time ros_now, std::function<void()> callback);

  void cancel() { canceled_ = true; }
  void reset(Time ros_now);  // the next call is a period from now, also after cancel()
  [[nodiscard]] bool is_canceled() const { return canceled_; }

  // For the context: whether a call is due, which then counts as made; the time until the next one.
  bool take_due(Time ros_now);
  [[nodiscard]] std::chrono::nanoseconds left(Time ros_now) const;
  void call() const { callback_(); }

 private:
  std::chrono::nanoseconds period_;
  bool by_wall_, canceled_ = false;
  Clock::time_point next_wall_;
  Time next_ros_{};
  std::function<void()> callback_;
};

class DOPPEL_API Context {
 public:
  // Reads `--ros-args ...` and ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE and so on, like programs of ROS
  // 2. Throws InputError if one of them is invalid. An unusable network is a warning.
  Context(int argc, const char* const* argv);
  explicit Context(ContextOptions options = {});
  ~Context();  // after its nodes
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // False after Ctrl-C or shutdown(); spinning functions then return.
  [[nodiscard]] bool ok() const;
  void shutdown();  // any thread

  // The command line without the program's name and ROS 2's arguments.
  [[nodiscard]] const std::vector<std::string>& arguments() const;

  void spin();  // until !ok()
  void spin_some();
  void spin_for(std::chrono::nanoseconds time);
  // Spins until the condition holds; false: the time is over, or !ok().
  bool spin_until(const std::function<bool()>& condition, std::chrono::nanoseconds at_most);

  // The present graph, including this program's own endpoints.
  [[nodiscard]] std::shared_ptr<const GraphSnapshot> graph() const;
  [[nodiscard]] NetworkStatus network() const;

  // -- for nodes (node.h)
  [[nodiscard]] Bus& bus();
  [[nodiscard]] Bridge& bridge();
  [[nodiscard]] bool is_logged(Severity severity) const;  // by --log-level
  // A line of a node's log, as rclcpp prints it.
  void log(Severity severity, const std::string& node, const std::string& text) const;
  [[nodiscard]] ParameterOverrides overrides_for(const doppel::Node& node) const;
  // Runs `callback` and keeps its exception for the spinning function.
  template <class Callback>
  void run(const Callback& callback) {
    try {
      callback();
    } catch (...) {
      keep(std::current_exception());
    }
  }
  void add(const std::shared_ptr<Timer>& timer);
  // Sets the time of /clock for nodes that use it; the bus's stamps then use it, too.
  void set_sim_time(Time now);
  [[nodiscard]] std::optional<Time> sim_time() const;

 private:
  void keep(std::exception_ptr failure);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel::ros2
