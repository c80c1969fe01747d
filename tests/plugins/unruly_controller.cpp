// A controller as a user's library has it, which throws, gives NaN or blocks in its tenth update.
#include <chrono>
#include <limits>
#include <stdexcept>
#include <thread>

#include "doppel/control/manager/controller.h"

namespace unruly {

class Unruly : public doppel::Controller {
 public:
  void on_init(doppel::ControllerContext& context) override {
    fault_ = doppel::declare<std::string>(context.node->parameters(), context.overrides, "fault", "throw");
  }
  [[nodiscard]] doppel::InterfaceConfiguration command_interfaces() const override {
    return {doppel::InterfaceConfiguration::Kind::individual, {"j1/position"}};
  }
  [[nodiscard]] doppel::InterfaceConfiguration state_interfaces() const override { return {}; }
  void update(doppel::Time /*now*/, doppel::Duration /*period*/) override {
    if (++updates_ < 10) return command_handles[0].set(0.05);
    if (fault_ == "throw") throw std::runtime_error("no solution");
    if (fault_ == "throw_number") throw 42;  // NOLINT: no std::exception
    if (fault_ == "give_nan") command_handles[0].set(std::numeric_limits<double>::quiet_NaN());
    if (fault_ == "give_infinity") command_handles[0].set(std::numeric_limits<double>::infinity());
    if (fault_ == "block" && updates_ == 10) std::this_thread::sleep_for(std::chrono::milliseconds(4500));
  }

 private:
  std::string fault_;
  int updates_ = 0;
};

}  // namespace unruly

DOPPEL_EXPORT_CONTROLLER(unruly::Unruly, "unruly/Unruly")
