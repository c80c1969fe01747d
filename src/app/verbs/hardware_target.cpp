#include "app/verbs/hardware_target.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

#include "app/description_target.h"
#include "app/verbs/shell.h"
#include "doppel/base/core/names.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel::app {
namespace {

const HardwareDescription& find_component(const RobotDescription& robot, const std::string& name) {
  std::vector<const HardwareDescription*> found;
  std::vector<std::string> names, plugins;
  for (const HardwareDescription& one : robot.hardware) {
    plugins.push_back(fmt::format("'{}' has {}", one.name, one.plugin));
    if (!is_servo_plugin(one.plugin)) continue;
    names.push_back(one.name);
    if (name.empty() || one.name == name) found.push_back(&one);
  }
  if (found.size() == 1) return *found.front();
  if (names.empty()) {
    std::vector<std::string_view> servo_names;
    for (const ServoPlugin& one : servo_plugins()) servo_names.push_back(one.name);
    throw InputError("hardware.no_component", {},
                     plugins.empty() ? "the description has no <ros2_control>"
                                     : fmt::format("no component of <ros2_control> drives servos: {}",
                                                   fmt::join(plugins, ", ")),
                     fmt::format("pass the argument that selects hardware, or use one of the plugins {}",
                                 fmt::join(servo_names, ", ")));
  }
  if (!name.empty() && found.empty())
    throw InputError("hardware.no_component", {},
                     fmt::format("no component is called '{}'{}", name, did_you_mean(name, names)));
  throw InputError("hardware.component", {},
                   fmt::format("there are several components: {}", fmt::join(names, ", ")),
                   "choose one with --component NAME");
}

}  // namespace

void add_hardware_target(CLI::App& verb, HardwareOptions& options) {
  add_target(verb, options.words);
  verb.add_option("--component", options.component, "Of the <ros2_control> blocks, if several drive servos")
      ->type_name("NAME");
  verb.add_option("--serial,--port", options.port,
                  "The port of the bus instead of that of the description: /dev/ttyUSB0, tcp://HOST:PORT")
      ->type_name("PORT");
  verb.add_option("--rate", options.rate, "bit/s instead of that of the description")
      ->check(CLI::PositiveNumber);
}

ServoSetup read_hardware_setup(const HardwareOptions& options) {
  DescriptionTarget target = open_target(options.words);
  target.arguments =
      hardware_arguments(target.target.description, std::move(target.arguments), target.resolver);
  const LoadedDescription description = load_target(target);
  Diagnostics diagnostics;
  const Model model = compile_model(description.robot, BaseKind::fixed, diagnostics);
  ServoSetup setup =
      read_servo_setup(find_component(description.robot, options.component), model, diagnostics);
  if (!options.port.empty()) setup.port = options.port;
  if (options.rate > 0) setup.rate = options.rate;
  return setup;
}

OpenBus open_bus(const HardwareOptions& options, const std::string& joint) {
  OpenBus out;
  out.setup = read_hardware_setup(options);
  if (!joint.empty()) static_cast<void>(servo_named(out.setup, joint));
  if (out.setup.protocol == ServoProtocol::servo_line)
    throw InputError(
        "hardware.no_registers", {},
        fmt::format("'{}' is a board with hobby servos, which have no registers and report nothing",
                    out.setup.component),
        "doppel hardware confirm; doppel man servo_firmware.md");
  out.link = open_servo_link(out.setup);
  out.bus = std::make_unique<ServoBus>(*out.link, out.setup.protocol, out.setup.rate);
  out.bus->notice_echo();
  return out;
}

bool confirmed(const std::string& question, bool yes) {
  if (yes) return true;
  if (isatty(STDIN_FILENO) == 0) {
    print_note(question + " (no terminal to ask: pass --yes)");
    return false;
  }
  print_out(question + " [y/N] ");
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

std::optional<bool> answer_of_person(const std::string& question) {
  if (isatty(STDIN_FILENO) == 0) return {};
  std::string answer;
  do {
    print_out(question + " [y/n] ");
    if (!std::getline(std::cin, answer)) return {};
  } while (answer != "y" && answer != "n");
  return answer == "y";
}

}  // namespace doppel::app
