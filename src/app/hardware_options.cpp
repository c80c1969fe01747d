#include "app/hardware_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "doppel/base/core/installation.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel::app {
namespace {

const std::vector<std::string> kMirrors{"shadow", "follow", "off", "rehearse"};  // as MirrorMode

// The description with its hardware, as use_sim:=false selects it.
void take_hardware(WorldRobot& robot) {
  OpenedTarget opened = doppel::open_target(robot.target, robot.arguments, data_folder() / "robots");
  robot.arguments = hardware_arguments(opened.target.description, robot.arguments, opened.resolver);
}

HardwareUse hardware_use(const HardwareRunOptions& options, const std::vector<WorldRobot>& robots) {
  if (options.ports) return HardwareUse::ports;
  if (options.emulate) return HardwareUse::emulated;
  const bool real = std::ranges::any_of(
      robots, [](const WorldRobot& one) { return !hardware_argument(one.arguments).empty(); });
  return real ? HardwareUse::real : HardwareUse::simulated;
}

// In `emulate` the controllers are the hand's; in `up` they are those of the driver, and the page has another
// way to move the hand.
void add_hand(CLI::App& verb, HardwareRunOptions& options) {
  const std::string usual =
      "joints whose torque is off: none: they fall, guide: a hand holds them and moves them as ";
  const CLI::IsMember choices =
      options.ports ? CLI::IsMember({"none", "guide", "sweep"}) : CLI::IsMember({"none", "guide"});
  verb.add_option(options.ports ? "--hand,--backdrive" : "--hand", options.hand,
                  options.ports ? "At " + usual +
                                      "'doppel move' and the page command, sweep: it moves each one through "
                                      "its whole range"
                                : "With --emulate, at " + usual + "the Calibrate panel of the page commands")
      ->check(choices)
      ->capture_default_str();
}

}  // namespace

void add_hardware_options(CLI::App& verb, HardwareRunOptions& options) {
  if (!options.ports)
    verb.add_flag(
        "--emulate", options.emulate,
        "Run the drivers of the description's servos on emulated buses, whose motors are the simulated "
        "joints");
  add_hand(verb, options);
  verb.add_option(
          "--protocol", options.protocol,
          "Where the description names no driver of servos, give every joint one of this protocol, as "
          "strong as its drive is, with ids from 1 on: a bus for any robot")
      ->check(CLI::IsMember({"feetech", "dynamixel", "servo_line"}));
  verb.add_option(
          "--faults", options.faults,
          "YAML file with faults of the emulated devices (doppel man hardware); it can be edited while "
          "they run")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  if (!options.ports) {
    CLI::Option* const mirror =
        verb.add_option("--mirror", options.mirror,
                        "The twin beside real hardware: shadow: it gets the same commands, so that "
                        "'doppel mirror' shows where the two differ, follow: it is where the measured joints "
                        "are, off: it gets no commands, rehearse: as shadow, and a trajectory first runs on "
                        "a copy of the twin: it is sent if nothing touches, and no joint is too slow or weak")
            ->check(CLI::IsMember(kMirrors))
            ->capture_default_str();
    verb.add_flag("--no-guard", options.no_guard,
                  "Do not refuse motions of devices that end in a contact of the robot's own links, or in a "
                  "keep-out box of the world");
    verb.add_flag("--no-shadow", options.no_shadow, "The same as --mirror follow")->excludes(mirror);
    return;
  }
  verb.add_option("--trace", options.trace, "Write all bytes of the bus to this file, with their times")
      ->type_name("FILE");
}

void apply(const HardwareRunOptions& options, std::uint64_t seed, Scenario& scenario) {
  if (options.emulate || options.ports) std::ranges::for_each(scenario.robots, take_hardware);
  scenario.hardware = hardware_use(options, scenario.robots);
  scenario.guard = !options.no_guard;
  scenario.emulation.faults = options.faults;
  scenario.emulation.trace = options.trace;
  scenario.emulation.seed = seed;
  if (!options.protocol.empty())
    scenario.emulation.servos = options.protocol == "feetech"     ? ServoProtocol::feetech
                                : options.protocol == "dynamixel" ? ServoProtocol::dynamixel
                                                                  : ServoProtocol::servo_line;
  const auto mirror = std::ranges::find(kMirrors, options.no_shadow ? "follow" : options.mirror);
  scenario.mirror = static_cast<MirrorMode>(mirror - kMirrors.begin());
  if (options.hand != "none")
    scenario.emulation.hand = options.hand == "guide" ? HandMotion::guide : HandMotion::sweep;
}

}  // namespace doppel::app
