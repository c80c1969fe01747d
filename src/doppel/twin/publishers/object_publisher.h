#pragma once
// /doppel/objects (visualization_msgs/msg/MarkerArray, latched): the world's objects as RViz's markers, ns
// "objects", text: the object's name, in the frame "world"; one marker for each visual shape. Published when an object is spawned, deleted or
// moved, at most at 25 Hz of simulated time. Every message has all objects, and DELETE for recently deleted
// ones, so that a subscriber that missed a message is up to date with the next one. A part of a mesh is a list of triangles
// whose mesh_resource, which RViz ignores, is the URI of the file with "#NAME", or "#NAME&center" if the part is centred.
//
// /doppel/scene (doppel_msgs/msg/Scene, latched): lights, surroundings, terrains, and what markers cannot express of
// materials; published when the objects are listed anew.

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/visualization_msgs.h"
#include "doppel/twin/loop/publish_schedule.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

// The URI of an object's mesh in messages; for one without a scheme the URI of its file.
DOPPEL_API std::string mesh_resource(const MeshGeometry& mesh);

// "file:///..." of a file.
DOPPEL_API std::string file_uri(const std::filesystem::path& file);

class DOPPEL_API ObjectPublisher : public Tickable {
 public:
  // The scene outlives the publisher.
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
  void list(Time now);
  bool update_poses();

  const Scene& scene_;
  Node node_;
  Publisher<visualization_msgs::msg::MarkerArray> topic_;
  Publisher<doppel_msgs::msg::Scene> surroundings_;
  PublishSchedule due_{Duration{40'000'000}};
  visualization_msgs::msg::MarkerArray message_;  // first the objects, in the scene's order, then the deleted
  // The shape of the marker at the same index.
  struct Part {
    int instance = 0, link = 0;
    Pose X_LS = Pose::Identity();   // the marker in the link
    std::optional<Pose> published;  // its pose as published last, in TF's world
  };
  std::vector<Part> parts_;
  std::deque<std::int32_t> gone_;  // ids of recently deleted objects
  std::int32_t next_id_ = 0;
  bool listed_ = false;
};

}  // namespace doppel
