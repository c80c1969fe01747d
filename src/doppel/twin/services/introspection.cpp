#include "doppel/twin/services/detail/introspection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/base/core/names.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {
namespace {

constexpr const char* kParameter = "service_introspection";
constexpr std::array<const char*, 3> kModes = {"disabled", "metadata",
                                               "contents"};  // in the order of ServiceEvents

Status mode_of(const ParameterValue& value, ServiceEvents& mode) {
  const auto* const text = std::get_if<std::string>(&value);
  const auto* const found = text == nullptr ? kModes.end() : std::ranges::find(kModes, *text);
  if (found == kModes.end()) {
    const std::vector<std::string> names(kModes.begin(), kModes.end());
    return Status::refused(fmt::format("{} is disabled, metadata or contents{}", kParameter,
                                       text == nullptr ? "" : did_you_mean(*text, names)));
  }
  mode = static_cast<ServiceEvents>(found - kModes.begin());
  return {};
}

}  // namespace

void declare_introspection(Node& node, const RosArguments& arguments) {
  ParameterFile of_command_line;
  add_ros_parameters(arguments, of_command_line);
  ParameterOverrides overrides = of_command_line.overrides_for(node.name(), node.given_name());
  const ParameterValue initial = declare_parameter(
      node.parameters(), &overrides, kParameter, std::string(kModes[0]),
      {.description =
           "What services publish of their calls on <service>/_service_event: disabled, metadata or "
           "contents",
       .check = [](const ParameterValue& value) {
         ServiceEvents mode{};
         return mode_of(value, mode);
       }});
  const auto apply = [&bus = node.bus()](const ParameterValue& value) {
    ServiceEvents mode{};
    if (mode_of(value, mode)) bus.set_service_events(mode);
  };
  apply(initial);
  node.parameters().on_change([apply](const std::string& name, const ParameterValue& value) {
    if (name == kParameter) apply(value);
  });
}

}  // namespace doppel
