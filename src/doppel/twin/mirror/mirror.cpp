#include "doppel/twin/mirror/mirror.h"

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"
#include "doppel/twin/mirror/detail/robot_devices.h"
#include "doppel/twin/mirror/detail/robot_mirror.h"

namespace doppel {
namespace {

constexpr Duration kLookPeriod{50'000'000};

class Mirror : public Tickable {
 public:
  explicit Mirror(TwinCore& core) : core_(core) {}

  [[nodiscard]] bool at_every_step() const override { return true; }
  void after_step(Time now) override {
    if (changed_) return;
    for (One& one : robots_) {
      if (one.mirror) one.mirror->after_step(*one.robot, now);
    }
  }
  void between_steps(Time now) override {
    if (changed_) look_up();
    if (now < next_look_ && now >= last_look_) return;
    last_look_ = now;
    next_look_ = now + kLookPeriod;
    for (One& one : robots_) look(one, now);
  }
  void show(Time now) override { next_look_ = now; }
  void reset(Time /*now*/) override {
    for (One& one : robots_) {
      if (one.mirror) one.mirror->restart();
    }
    next_look_ = Time::min();
  }
  // Only noted: a reload may be undone, and nodes must not be destroyed while it is under way.
  void instances_changed() override { changed_ = true; }

 private:
  struct One {
    TwinRobot* robot = nullptr;
    std::unique_ptr<RobotDevices> devices;
    std::unique_ptr<RobotMirror> mirror;
  };

  void look_up() {
    changed_ = false;
    robots_.clear();
    const Scenario& scenario = core_.scenario();
    const bool guided =
        scenario.hardware == HardwareUse::emulated && scenario.emulation.hand == HandMotion::guide;
    for (const auto& robot : core_.robots()) {
      if (!has_devices(*robot)) continue;
      One one{robot.get(),
              std::make_unique<RobotDevices>(core_.bus(), *robot, resting_[robot->name_space()], guided),
              nullptr};
      if (robot->has_loop())
        one.mirror = std::make_unique<RobotMirror>(core_.bus(), *robot, core_.scenario().mirror);
      robots_.push_back(std::move(one));
    }
    next_look_ = Time::min();
  }

  void look(One& one, Time now) const {
    one.devices->collect(*one.robot);
    one.devices->publish(now);
    if (!one.mirror) return;
    one.mirror->look(*one.robot, *one.devices, now, core_.log());
    one.mirror->publish(*one.robot, now);
  }

  TwinCore& core_;
  std::map<std::string, std::vector<std::string>> resting_;  // controllers, by namespace
  std::vector<One> robots_;                                  // with devices
  bool changed_ = true;
  Time next_look_ = Time::min(), last_look_ = Time::min();
};

}  // namespace

void add_mirror(TwinCore& core) {
  core.add(std::make_unique<Mirror>(core));
}

}  // namespace doppel
