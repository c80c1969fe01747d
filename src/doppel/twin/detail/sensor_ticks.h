#pragma once
// The sensors of light of all robots of a twin, in its loop.

#include <functional>
#include <memory>
#include <vector>

#include "doppel/sensing/light_rig.h"
#include "doppel/twin/compiled_robot.h"
#include "doppel/twin/scene.h"
#include "doppel/twin/tickable.h"

namespace doppel {

class SensorTicks : public Tickable {
 public:
  using Robots = std::function<std::vector<std::shared_ptr<const CompiledRobot>>()>;
  // The log and the scene outlive this.
  SensorTicks(Bus& bus, const Scene& scene, const Log& log, const RigOptions& options, Robots robots)
      : scene_(scene), robots_(std::move(robots)), rig_(bus, log, options) {
    look_up();
  }

  [[nodiscard]] bool at_every_step() const override { return true; }
  void after_step(Time now) override { rig_.after_step(now, scene_.engine()); }
  void between_steps(Time now) override {
    if (changed_) look_up();
    rig_.between_steps(now);
  }
  void reset(Time now) override { rig_.reset(now); }
  // Only noted: a reload may be undone, and nodes must not be destroyed while it is under way.
  void instances_changed() override { changed_ = true; }
  [[nodiscard]] const LightRig& rig() const { return rig_; }

 private:
  void look_up();

  const Scene& scene_;
  const Robots robots_;
  std::vector<std::shared_ptr<const CompiledRobot>> known_;  // of which the rig's sensors are
  LightRig rig_;
  bool changed_ = false;
};

}  // namespace doppel
