// A hardware component as a user would write it: built separately into a shared library, and loaded by path.

#include "doppel/control/hardware/hardware_registry.h"

namespace test_plugin {

class Still : public doppel::HardwareComponent {
 public:
  doppel::Status on_init(const doppel::HardwareInfo& info) override {
    for (const auto& joint : info.description.joints) joints_.push_back(joint.name);
    return {};
  }
  [[nodiscard]] std::vector<doppel::InterfaceDescription> state_interfaces() const override {
    std::vector<doppel::InterfaceDescription> out;
    for (const std::string& joint : joints_) out.push_back({joint, doppel::kPosition, 0.0});
    return out;
  }
  [[nodiscard]] std::vector<doppel::InterfaceDescription> command_interfaces() const override { return {}; }
  [[nodiscard]] doppel::PassiveJoint when_unclaimed() const override { return doppel::PassiveJoint::hold; }
  void on_stop() override {}
  void on_stop_reset() override {}
  doppel::HardwareReturn read(doppel::Time, doppel::Duration, std::span<double> states) override {
    for (double& state : states) state = 0.125;
    return doppel::HardwareReturn::ok;
  }
  doppel::HardwareReturn write(doppel::Time, doppel::Duration, std::span<const double>) override {
    return doppel::HardwareReturn::ok;
  }

 private:
  std::vector<std::string> joints_;
};

}  // namespace test_plugin

DOPPEL_EXPORT_HARDWARE(test_plugin::Still, "test_plugin/Still")
