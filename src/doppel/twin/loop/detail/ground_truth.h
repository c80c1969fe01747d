#pragma once
// ground_truth/odom (nav_msgs/msg/Odometry) of a robot with a floating base, in its namespace: the true pose and
// velocity of the root link, as Gazebo's p3d plugin publishes them. The pose is in the frame "world" of TF,
// which stands where a robot without a namespace starts; robots with one share that of the simulation, also with a
// TF of their own. The velocity is along the axes of the root link (REP 105). Published at 50 Hz of simulated time.

#include <functional>

#include "doppel/physics/contract/engine.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/scenario/compile/compiled_robot.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class GroundTruth : public Tickable {
 public:
  // `instance`: the robot's present handle.
  using Present = std::function<const Instance&()>;
  GroundTruth(Bus& bus, const CompiledRobot& robot, Present instance, Time now);

  Time publish(Time now) override;
  [[nodiscard]] Time next_after(Time now) const override { return now + period(); }
  void show(Time now) override;
  void reset(Time now) override { pace_.restart(now); }
  void save(SavedSlot& slot) override { save_run(pace_, slot); }
  void restore(const SavedPart* saved, Time /*now*/) override {
    if (saved != nullptr) restore_run(*saved, pace_);
  }

 private:
  [[nodiscard]] Duration period() const;

  const Present instance_;
  const bool shares_world_;  // the frame "world" is that of all robots
  Node node_;
  Publisher<nav_msgs::msg::Odometry> topic_;
  nav_msgs::msg::Odometry message_;
  Pace pace_;
};

}  // namespace doppel
