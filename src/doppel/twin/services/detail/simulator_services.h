#pragma once
// The simulator's node, /gazebo, with Gazebo's names and types: pause, step, reset, speed, efforts and
// wrenches on robots and objects, and the state of joints (for poses of objects see entity_services.h).
// Loop's thread only, between steps. Names of joints and links: entity.h.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

class SimulatorServices : public Tickable {
 public:
  explicit SimulatorServices(TwinCore& core);

  void pause() { time_control_.paused = true; }
  Status resume();  // refused while the physics is diverged
  // Steps a paused simulation. Refused in the cases of resume().
  Status step(std::uint32_t steps);
  // Pauses at that time.
  void pause_at(Time when) { pause_at_ = when; }

  // Efforts and wrenches of clients.
  [[nodiscard]] std::string acting_loads() const override;
  [[nodiscard]] bool at_every_step() const override { return true; }
  // Starts and ends the timed efforts and wrenches that are due.
  void before_step(Time now) override {
    if (now >= next_change_) apply_due(now);
  }
  void after_step(Time now) override {
    if (now < pause_at_) return;
    pause_at_ = Time::max();
    pause();
  }
  // Responds to calls of ~/step whose steps are complete.
  void between_steps(Time /*now*/) override {
    if (!stepping_.empty()) answer_finished_steps();
  }
  // Removes all loads.
  void reset(Time now) override;
  void save(SavedSlot& slot) override;
  void restore(const SavedPart* saved, Time now) override;
  // Loads continue on bodies that keep their name and model; a new body with the name of a deleted
  // one gets none.
  void instances_changed() override;

 private:
  // An effort on a joint, or a wrench on a link, and the time interval in which it acts.
  struct Load {
    BodyId body;                         // of a joint only the instance is used
    int joint = -1;                      // of the instance
    std::shared_ptr<const Model> model;  // of the instance: distinguishes a new instance of the same name
    std::string name;                    // of the instance
    double effort = 0;                   // N m or N
    Eigen::Vector3d p_BoP_B = Eigen::Vector3d::Zero(), force_W = Eigen::Vector3d::Zero(),
                    torque_W = Eigen::Vector3d::Zero();
    Time start{}, end{};
    [[nodiscard]] bool on_same_body(const Load& other) const {
      return joint < 0 && other.joint < 0 && body == other.body;
    }
  };
  struct Saved {
    std::vector<Load> loads;
    Time next_change{}, pause_at{};
  };
  // A call of ~/step, responded to when the requested steps have run.
  struct Stepping {
    std::uint32_t steps = 0;
    std::uint64_t last = 0;
    Responder<doppel_msgs::srv::Step::Response> respond;
  };
  void offer_time_services();
  void offer_step();
  void answer_finished_steps();
  void refuse_owed_steps(const std::string& why);
  void offer_joint_efforts();
  void offer_link_wrenches();
  void offer_joint_state();

  void apply_due(Time now);
  [[nodiscard]] double effort_on(int instance, int joint, Time now) const;
  // The effort with those that already act or will act on the joint.
  [[nodiscard]] Status check_effort(const std::string& name, const Load& load) const;
  [[nodiscard]] Status can_take_steps() const;
  [[nodiscard]] std::string effort_text(int instance, int joint,
                                        const gazebo_msgs::srv::ApplyJointEffort::Request& request) const;
  // Efforts on a joint are added; a wrench replaces the one on the same link or object.
  Status add_load(Load load, const builtin_interfaces::msg::Time& start,
                  const builtin_interfaces::msg::Duration& duration);
  Status add_wrench(const std::string& body, const std::string& frame, const geometry_msgs::msg::Point& point,
                    const geometry_msgs::msg::Wrench& wrench, const builtin_interfaces::msg::Time& start,
                    const builtin_interfaces::msg::Duration& duration);
  Status write_state(const std::vector<std::string>& names, const std::vector<double>& positions,
                     const std::vector<double>& velocities);
  void fill_state(doppel_msgs::srv::GetState::Response& response) const;
  [[nodiscard]] Status find_body(const std::string& name, Load& load) const;

  TwinCore& core_;
  const Scene& scene_ = core_.scene();
  TimeControl& time_control_ = core_.time_control();
  Node node_;
  std::vector<Stepping> stepping_;  // in the order of the calls
  std::uint64_t steps_asked_ = 0;   // since the pause
  std::vector<Load> loads_;
  Time next_change_ = Time::max(), pause_at_ = Time::max();
};

}  // namespace doppel
