#pragma once
// The sensors of light of all robots and models of a twin, in its loop.

#include <functional>
#include <memory>
#include <vector>

#include "doppel/sensing/light_rig.h"
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
  };
  // The log and the scene outlive this.
  SensorTicks(Bus& bus, const Scene& scene, const Log& log, const RigOptions& options, Sources sources)
      : bus_(bus), scene_(scene), sources_(std::move(sources)), rig_(bus, log, options) {
    instances_changed();
  }

  [[nodiscard]] bool at_every_step() const override { return true; }
  void after_step(Time now) override { rig_.after_step(now, scene_.engine()); }
  void between_steps(Time now) override { rig_.between_steps(now); }
  void reset(Time now) override { rig_.reset(now); }
  void instances_changed() override;
  [[nodiscard]] const LightRig& rig() const { return rig_; }

 private:
  // The frames of static models, in "world", on /tf_static.
  void publish_frames(const std::vector<ModelSensors>& models);

  Bus& bus_;
  const Scene& scene_;
  const Sources sources_;
  std::unique_ptr<Node> node_;  // of the frames; nullptr: there are none
  Publisher<tf2_msgs::msg::TFMessage> tf_static_;
  std::vector<std::shared_ptr<const CompiledRobot>> known_;  // of which the rig's sensors are
  std::shared_ptr<const std::vector<ModelSensors>> known_models_;
  LightRig rig_;
};

}  // namespace doppel
