// A controller as a user would write it: built separately into a shared library, and loaded by path.

#include "doppel/control/manager/controller.h"

namespace test_plugin {

class Constant : public doppel::Controller {
 public:
  void on_init(doppel::ControllerContext& context) override {
    joint_ = doppel::declare<std::string>(context.node->parameters(), context.overrides, "joint", "a");
    value_ = doppel::declare<double>(context.node->parameters(), context.overrides, "value", 0.25);
  }
  [[nodiscard]] doppel::InterfaceConfiguration command_interfaces() const override {
    return {doppel::InterfaceConfiguration::Kind::individual, {joint_ + "/position"}};
  }
  [[nodiscard]] doppel::InterfaceConfiguration state_interfaces() const override { return {}; }
  void update(doppel::Time, doppel::Duration) override { command_handles[0].set(value_); }

 private:
  std::string joint_;
  double value_ = 0;
};

}  // namespace test_plugin

DOPPEL_EXPORT_CONTROLLER(test_plugin::Constant, "test_plugin/Constant")
