#pragma once
// The devices of a description's <ros2_control>, as the verbs of hardware reach them.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/serial/byte_link.h"

namespace CLI {
class App;
}

namespace doppel::app {

struct HardwareOptions {
  std::vector<std::string> words;  // TARGET and its arguments
  std::string component, port;     // empty: the only one, and that of its setup
  int rate = 0;                    // bit/s; 0: that of its setup
};
void add_hardware_target(CLI::App& verb, HardwareOptions& options);

// The setup of the component, with the options' port and rate. The description is expanded for hardware
// (use_sim:=false). Throws InputError: no component of servos, several, wrong parameters.
ServoSetup read_hardware_setup(const HardwareOptions& options);

struct OpenBus {
  ServoSetup setup;
  std::unique_ptr<ByteLink> link;
  std::unique_ptr<ServoBus> bus;
};
// Throws InputError as open_link(), and before where no servo drives `joint`; empty: no certain one.
OpenBus open_bus(const HardwareOptions& options, const std::string& joint = "");

// A question that a person answers with y or n; `yes`: it is answered. Without a terminal the answer is no.
bool confirmed(const std::string& question, bool yes);
// A person's answer, which no option replaces; nullopt: there is no terminal, or no answer.
std::optional<bool> answer_of_person(const std::string& question);

}  // namespace doppel::app
