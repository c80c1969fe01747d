#include "doppel/twin/control_stack.h"

#include <algorithm>

namespace doppel {

ControlStack::ControlStack(Bus& bus, const Machine& machine, const ControllerRegistry& registry,
                           bool enforce_limits, const Log& log, Diagnostics& diagnostics)
    : model_(machine.model), controllers_(machine.setup.controllers) {
  ControllerManagerOptions options;
  options.physics_step = machine.setup.world.step;
  options.enforce_limits = enforce_limits;
  manager_ =
      std::make_unique<ControllerManager>(bus, model_, registry, &controllers_, options, log, diagnostics);
  for (const HardwareDescription& hardware : machine.hardware) {
    auto system = std::make_unique<SimulatedHardware>(hardware, model_, *machine.engine, diagnostics);
    hardware_.push_back(system.get());
    manager_->add_hardware(std::move(system));
  }
  diagnostics.throw_if_errors();
}

void ControlStack::start(const ControllerWish& wish, const Log& log) {
  manager_->start(wish.active);
  for (const std::string& name : wish.inactive) {
    manager_->load(name);
    if (const Status configured = manager_->configure(name); !configured) log.warning(name, configured.why());
  }
}

ControllerWish ControlStack::wish_of(const std::vector<std::string>& activate) const {
  ControllerWish wish;
  wish.active = activate;
  for (const auto& [name, type] : manager_->declared_controllers()) {
    if (activate.empty()) {
      wish.active.push_back(name);
    } else if (std::find(activate.begin(), activate.end(), name) == activate.end()) {
      wish.inactive.push_back(name);
    }
  }
  return wish;
}

ControllerWish ControlStack::present_wish() const {
  ControllerWish wish;
  for (const ControllerView& controller : manager_->controllers()) {
    (controller.state == ControllerState::active ? wish.active : wish.inactive).push_back(controller.name);
  }
  for (const auto& [name, type] : manager_->declared_controllers()) wish.declared.push_back(name);
  return wish;
}

void ControlStack::take_over(const Machine& before, const Machine& machine) {
  model_ = machine.model;
  manager_->model_changed();
  for (SimulatedHardware* hardware : hardware_) hardware->rebind(*machine.engine);
  for (std::size_t j = 0; j < model_.joints.size(); ++j) {
    const int joint = static_cast<int>(j);
    if (machine.engine->drive(joint) == DriveMode::position) {
      machine.engine->set_drive_reference(joint, before.engine->drive_reference(joint));
    }
  }
}

}  // namespace doppel
