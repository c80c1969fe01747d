#pragma once
// The sensors of all robots of a twin, in its loop. /doppel/sensors (doppel_msgs/msg/Sensors, latched) lists them with
// the rates that they reach, once a second.

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "doppel/sensing/light_rig.h"
#include "doppel/sensing/physical_rig.h"
#include "doppel/twin/compiled_robot.h"
#include "doppel/twin/scene.h"
#include "doppel/twin/tickable.h"

namespace doppel {

class SensorTicks : public Tickable {
 public:
  using Robots = std::function<std::vector<std::shared_ptr<const CompiledRobot>>()>;
  // The log and the scene outlive this.
  SensorTicks(Bus& bus, const Scene& scene, const Log& log, const RigOptions& options, Robots robots)
      : bus_(bus),
        scene_(scene),
        robots_(std::move(robots)),
        light_(bus, log, options),
        physical_(bus, log, options) {
    instances_changed();
  }

  [[nodiscard]] bool at_every_step() const override { return true; }
  void before_step(Time /*now*/) override { physical_.before_step(scene_.engine()); }
  void after_step(Time now) override { light_.after_step(now, scene_.engine()); }
  Time publish(Time /*now*/) override { return physical_.publish(scene_.engine()); }
  [[nodiscard]] Time next_after(Time /*now*/) const override { return physical_.next(); }
  void between_steps(Time now) override;
  void reset(Time now) override;
  void instances_changed() override;
  [[nodiscard]] std::vector<RigStatus> status() const;

 private:
  Bus& bus_;
  const Scene& scene_;
  const Robots robots_;
  std::vector<std::shared_ptr<const CompiledRobot>> known_;  // of which the rigs' sensors are
  LightRig light_;
  PhysicalRig physical_;
  std::optional<Node> list_;  // while there are sensors
  Publisher<doppel_msgs::msg::Sensors> topic_;
  Time list_due_ = Time::min();
};

}  // namespace doppel
