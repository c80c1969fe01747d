#pragma once
// /clock at 100 Hz of simulated time, on the node /gazebo; not published with wall-clock stamps.

#include <optional>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class ClockPublisher : public Tickable {
 public:
  // The scene outlives it; the rate is rounded to whole steps of its engine.
  ClockPublisher(Bus& bus, const Scene& scene);

  Time publish(Time now) override;
  void show(Time now) override { publish_clock(now); }
  void reset(Time now) override { pace_.restart(now); }
  void save(SavedSlot& slot) override { save_run(pace_, slot); }
  void restore(const SavedPart* saved, Time /*now*/) override {
    if (saved != nullptr) restore_run(*saved, pace_);
  }

 private:
  void publish_clock(Time now);

  std::optional<Node> node_;
  Publisher<rosgraph_msgs::msg::Clock> clock_;
  const Scene& scene_;
  Pace pace_;
};

}  // namespace doppel
