#include "doppel/devices/emulated_robot/emulated_hardware.h"

namespace doppel {

EmulatedHardware::EmulatedHardware(Instance robot)
    : ServoHardware([this](const ServoSetup& setup) {
        auto out = std::make_unique<EmulatedLink>(*devices_, "emulated bus", setup.rate);
        link_ = out.get();
        link_->follow(robot_.engine().time());
        return out;
      }),
      robot_(robot) {}

Status EmulatedHardware::on_init(const HardwareInfo& info) {
  Status out = ServoHardware::on_init(info);
  if (!out) return out;
  devices_ = emulated_devices(setup());
  motors_ = std::make_unique<EngineMotors>(setup(), robot_);
  // The servos measure where the joints are before the first step.
  motors_->step(*devices_, robot_, robot_.engine().time(), robot_.engine().world().settings().step);
  return out;
}

HardwareReturn EmulatedHardware::read(Time now, Duration period, std::span<double> states) {
  if (link_ != nullptr) link_->follow(robot_.engine().time());
  return ServoHardware::read(now, period, states);
}

void EmulatedHardware::before_step() {
  motors_->step(*devices_, robot_, robot_.engine().time(), robot_.engine().world().settings().step);
}

void register_emulated_hardware(HardwareRegistry& registry, Instance robot) {
  for (const ServoPlugin& plugin : servo_plugins())
    registry.replace(std::string(plugin.name), HardwareKind::emulated,
                     [robot] { return std::make_unique<EmulatedHardware>(robot); });
}

}  // namespace doppel
