#pragma once
// /doppel/objects (visualization_msgs/msg/MarkerArray, latched): the world's objects as RViz's markers, ns
// "objects", text: the object's name, in the frame "world". Published when one comes, goes, or has moved, 25
// times a second of simulated time at most. Every message has all objects, and DELETE for those that went
// lately, so that who missed one is right with the next.

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/export.h"
#include "doppel/messages/visualization_msgs.h"
#include "doppel/twin/publish_schedule.h"
#include "doppel/twin/scene.h"
#include "doppel/twin/tickable.h"

namespace doppel {

// The URI under which listeners are notified of an object's mesh; one without a scheme is its file's.
DOPPEL_API std::string mesh_resource(const MeshGeometry& mesh);

class DOPPEL_API ObjectPublisher : public Tickable {
 public:
  // The scene outlives it.
  ObjectPublisher(Bus& bus, const Scene& scene);

  void between_steps(Time now) override {
    if (due_(now, true)) publish_changes(now);
  }
  void show(Time /*now*/) override { at_once(); }
  void instances_changed() override { at_once(); }

 private:
  void at_once() {
    listed_ = false;
    due_.at_once();
  }
  void publish_changes(Time now);
  void list();
  bool update_poses();

  const Scene& scene_;
  Node node_;
  Publisher<visualization_msgs::msg::MarkerArray> topic_;
  PublishSchedule due_{Duration{40'000'000}};
  visualization_msgs::msg::MarkerArray message_;  // first the objects, in the scene's order, then the deleted
  std::vector<std::optional<Pose>> published_;    // [objects] as published last
  std::deque<std::int32_t> gone_;                 // the last that went
  std::int32_t next_id_ = 0;
  bool listed_ = false;
};

}  // namespace doppel
