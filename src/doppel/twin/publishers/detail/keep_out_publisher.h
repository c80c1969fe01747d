#pragma once
// /doppel/keep_out (visualization_msgs/msg/MarkerArray, latched): the boxes of the world file that no robot
// may enter, as RViz's markers in the frame "world": a cube in ns "keep_out", whose text is the box's name,
// and that name above it in ns "keep_out_names". Each message replaces the one before.

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/visualization_msgs.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class TwinCore;

class KeepOutPublisher : public Tickable {
 public:
  // The core outlives it.
  explicit KeepOutPublisher(TwinCore& core);

  void between_steps(Time now) override {
    if (!published_) publish_boxes(now);
  }
  void instances_changed() override { published_ = false; }

 private:
  void publish_boxes(Time now);

  TwinCore& core_;
  Node node_;
  Publisher<visualization_msgs::msg::MarkerArray> topic_;
  bool published_ = false;
};

}  // namespace doppel
