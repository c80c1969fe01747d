#include "app/verbs/teleop_options.h"

#include <fmt/format.h>

#include <cstdlib>

#include "app/description_target.h"

namespace doppel::app {

std::unique_ptr<ros2::Context> open_context(const TeleopOptions& options, const std::string& params_file) {
  ros2::ContextOptions chosen;
  chosen.arguments = *options.ros;
  if (!params_file.empty()) {
    auto& parameters = chosen.arguments.parameters;
    parameters.insert(parameters.begin(), GivenParameterFile{params_file});
  }
  Diagnostics diagnostics;
  chosen.network = ros2::from_environment([](const char* name) { return std::getenv(name); }, diagnostics);
  print_diagnostics(diagnostics);
  if (options.no_ros) chosen.network.range = ros2::DiscoveryRange::off;
  chosen.catch_signals = false;
  return std::make_unique<ros2::Context>(std::move(chosen));
}

std::optional<bool> asked_stamped(const TeleopOptions& options, ParameterOverrides& written,
                                  const char* parameter) {
  const ParameterOverride* const given = written.find(parameter);
  if (given != nullptr && std::holds_alternative<bool>(given->value)) return std::get<bool>(given->value);
  if (options.type == "auto") return std::nullopt;
  return options.type == "stamped";
}

VelocityTopic open_velocity(Client& twin, const ros2::Node& node, const TeleopOptions& options,
                            std::optional<bool> stamped) {
  std::string asked = options.topic;
  if (asked.empty()) {
    constexpr const char* kName = "cmd_vel";
    const std::string renamed = node.context().bus().names().resolve(NameKind::topic, kName, node.name());
    if (renamed != node.name().substr(0, node.name().rfind('/') + 1) + kName) asked = renamed;
  }
  const VelocityTopic topic = find_velocity_topic(twin, asked, stamped);
  print_note(fmt::format("driving by {} ({})", topic.name, topic.stamped ? "TwistStamped" : "Twist"));
  return topic;
}

void report_unused_parameters(const ParameterOverrides& written, ros2::Node& node) {
  Diagnostics diagnostics;
  report_unused(written, node.name(), node.on_bus().parameters().names(), diagnostics);
  print_diagnostics(diagnostics);
}

StopAtExit::~StopAtExit() {
  Shell::clear_interrupt();
  try {
    base_.send({});
    base_.flush();
  } catch (...) {  // the twin is gone, and with it the base
  }
}

}  // namespace doppel::app
