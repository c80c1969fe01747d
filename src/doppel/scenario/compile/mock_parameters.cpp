#include "doppel/scenario/compile/detail/mock_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"

namespace doppel {
namespace {

struct MockParameter {
  std::string_view name, here;
};
constexpr std::array kMockParameters{
    MockParameter{"calculate_dynamics", "the physics moves the joints, with velocities and accelerations"},
    MockParameter{"mock_sensor_commands", "sensors are simulated, and have no commands"},
    MockParameter{"fake_sensor_commands", "sensors are simulated, and have no commands"},
    MockParameter{"mock_gpio_commands", "states of a gpio keep their initial values"},
    MockParameter{"fake_gpio_commands", "states of a gpio keep their initial values"},
    MockParameter{"state_following_offset",
                  "states are those of the physics; doppel/Loopback has a fault 'wrong'"},
    MockParameter{"position_state_following_offset",
                  "states are those of the physics; doppel/Loopback has a fault 'wrong'"},
    MockParameter{"custom_interface_with_following_offset", "states are those of the physics"},
    MockParameter{"disable_commands", "commands are followed; doppel/Loopback has a fault 'silent'"},
};

}  // namespace

void report_mock_parameters(const HardwareDescription& hardware, Diagnostics& diagnostics) {
  std::vector<std::string> names{"unclaimed"};
  for (const MockParameter& one : kMockParameters) names.emplace_back(one.name);
  for (const auto& [name, value] : hardware.params) {
    if (name == "unclaimed") continue;
    const auto found = std::ranges::find(kMockParameters, name, &MockParameter::name);
    if (found == kMockParameters.end()) {
      diagnostics.warning(
          "ros2_control.unknown_param", hardware.plugin_source,
          fmt::format("'{}' has no <param> '{}'{}", hardware.plugin, name, did_you_mean(name, names)));
    } else if (value != "false" && parse_number(value) != 0.0) {
      diagnostics.note(
          "ros2_control.param_unused", hardware.plugin_source,
          fmt::format("<param> '{}' of '{}' has no effect: {}", name, hardware.plugin, found->here));
    }
  }
}

}  // namespace doppel
