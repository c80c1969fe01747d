#pragma once
// The simulator as a node, /gazebo, by the names and types that its users know: pause, step, reset, speed,
// efforts and wrenches on the machine, and its joints' state (entity_services.h: where its objects are).
// Everything runs on the loop's thread, between steps.

#include <functional>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/messages/doppel_msgs.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/physics/engine.h"

namespace doppel {

// Whether and how fast time runs. Written by services, read by the runner, both on the loop's thread.
struct TimeControl {
  bool paused = false;
  std::uint64_t steps_owed = 0;  // steps to run although paused
  double speed = 1.0;            // simulated per wall second; 0: as fast as possible
};

class SimulatorServices {
 public:
  struct Callbacks {
    std::function<void()> reset;          // back to the start
    std::function<void()> state_written;  // the pose was set from outside: controllers hold there
  };
  SimulatorServices(Bus& bus, const Model& model, Engine& engine, Callbacks callbacks);

  // In the loop: starts and ends the timed efforts and wrenches that are due.
  void before_step(Time now) {
    if (now >= next_change_) apply_due(now);
  }
  // Between steps: answers calls of ~/step whose steps have run since.
  void answer_steps() {
    if (!stepping_.empty()) answer_finished_steps();
  }
  void forget_loads();
  // After objects came or went: who has the name of one that is gone is not pushed in its place.
  void forget_loads_of_gone_objects();
  // Another engine for a model with the same links and joints takes over, with the loads that act.
  void rebind(Engine& engine);

  [[nodiscard]] TimeControl& time_control() { return time_control_; }

 private:
  // An effort on a joint, or a wrench on a link or an object, and the time in which it acts.
  struct Load {
    int joint = -1, link = -1;
    std::string object;
    double effort = 0;
    Eigen::Vector3d p_BoP_B = Eigen::Vector3d::Zero(), force_W = Eigen::Vector3d::Zero(),
                    torque_W = Eigen::Vector3d::Zero();
    Time start{}, end{};
    [[nodiscard]] bool on_same_body(const Load& other) const {
      return joint < 0 && other.joint < 0 && link == other.link && object == other.object;
    }
  };
  // A call of ~/step, answered once so many of the steps that were asked for have run.
  struct Stepping {
    std::uint32_t steps = 0;
    std::uint64_t last = 0;
    Responder<doppel_msgs::srv::Step::Response> respond;
  };
  void offer_time_services();
  void offer_step();
  void answer_finished_steps();
  void offer_joint_efforts();
  void offer_link_wrenches();
  void offer_joint_state();

  void apply_due(Time now);
  [[nodiscard]] double effort_on(int joint, Time now) const;
  // Efforts add up; a wrench replaces the one that acts on the same link or object.
  Status add_load(Load load, const builtin_interfaces::msg::Time& start,
                  const builtin_interfaces::msg::Duration& duration);
  Status add_wrench(const std::string& body, const std::string& frame, const geometry_msgs::msg::Point& point,
                    const geometry_msgs::msg::Wrench& wrench, const builtin_interfaces::msg::Time& start,
                    const builtin_interfaces::msg::Duration& duration);
  Status write_state(const std::vector<std::string>& names, const std::vector<double>& positions,
                     const std::vector<double>& velocities);
  [[nodiscard]] Status find_scalar_joint(const std::string& name, int& joint) const;
  [[nodiscard]] Status find_body(const std::string& name, Load& load) const;

  const Model& model_;
  Engine* engine_;
  Callbacks callbacks_;
  Node node_;
  TimeControl time_control_;
  std::vector<Stepping> stepping_;  // in the order of asking
  std::uint64_t steps_asked_ = 0;   // since time stands
  std::vector<Load> loads_;
  Time next_change_ = Time::max();
};

}  // namespace doppel
