#pragma once
// The sensors of all robots and models of a twin, in its loop. /doppel/sensors (doppel_msgs/msg/Sensors, latched) lists
// them with the rates that they reach, once a second.

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "doppel/sensing/light_rig.h"
#include "doppel/sensing/physical_rig.h"
#include "doppel/twin/compiled_scenario.h"
#include "doppel/twin/scene.h"
#include "doppel/twin/state_publisher.h"
#include "doppel/twin/tickable.h"

namespace doppel {

class SensorTicks : public Tickable {
 public:
  using Robots = std::function<std::vector<std::shared_ptr<const CompiledRobot>>()>;
  using Models = std::function<std::shared_ptr<const std::vector<ModelSensors>>()>;
  struct Sources {
    Robots robots;
    Models models;
    std::shared_ptr<StaticTransforms> statics;  // of the bus
    std::shared_ptr<const EarthFrame> earth;    // of the present world
  };
  // The log and the scene outlive this.
  SensorTicks(Bus& bus, const Scene& scene, const Log& log, const RigOptions& options, Sources sources)
      : bus_(bus),
        scene_(scene),
        sources_(std::move(sources)),
        light_(bus, log, options),
        physical_(bus, log, options) {
    look_up();
  }

  [[nodiscard]] bool at_every_step() const override { return true; }
  void before_step(Time /*now*/) override {
    if (!changed_) physical_.before_step(scene_.engine());
  }
  void after_step(Time now) override { light_.after_step(now, scene_.engine()); }
  Time publish(Time now) override { return changed_ ? now : physical_.publish(scene_.engine()); }
  [[nodiscard]] Time next_after(Time /*now*/) const override { return physical_.next(); }
  void between_steps(Time now) override;
  void reset(Time now) override;
  // Only noted: a reload may be undone, and nodes must not be destroyed while it is under way.
  void instances_changed() override { changed_ = true; }
  [[nodiscard]] std::vector<RigStatus> status() const;

 private:
  void look_up();
  void list_sensors();
  // The frames of static models, in "world", on /tf_static.
  void publish_frames(const std::vector<ModelSensors>& models);

  Bus& bus_;
  const Scene& scene_;
  const Sources sources_;
  std::unique_ptr<Node> frames_node_;  // nullptr: there are no such frames
  Publisher<tf2_msgs::msg::TFMessage> tf_static_;
  std::vector<std::shared_ptr<const CompiledRobot>> known_;  // of which the rigs' sensors are
  std::shared_ptr<const std::vector<ModelSensors>> known_models_;
  LightRig light_;
  PhysicalRig physical_;
  std::optional<Node> list_node_;  // while there are sensors
  Publisher<doppel_msgs::msg::Sensors> list_topic_;
  doppel_msgs::msg::Sensors list_;  // first those of light, then the physical ones
  std::size_t lights_ = 0;          // number of the former
  Time list_due_ = Time::min();
  bool changed_ = false;
};

}  // namespace doppel
