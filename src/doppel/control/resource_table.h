#pragma once
// The hardware components and their interfaces: who offers what, who holds which command. Addresses of values
// stay valid for the table's life. Commands are kept twice: as controllers wrote them, and as they went out
// after the limits.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/control/controller.h"
#include "doppel/control/hardware.h"

namespace doppel {

enum class HardwareState { unconfigured, inactive, active };
std::string_view to_string(HardwareState state);

class ResourceTable {
 public:
  struct Component {
    std::unique_ptr<SystemInterface> system;
    HardwareState state = HardwareState::unconfigured;
    std::vector<InterfaceDescription> state_descriptions, command_descriptions;
    std::vector<std::string> state_names, command_names;  // full names
    std::vector<double> states, asked, applied;           // asked: by controllers; applied: to the hardware
    std::vector<std::string> claimed_by;                  // of each command; empty: nobody
    std::size_t first_command = 0;                        // its index among all commands
  };

  // Throws InputError where an interface is offered already. Returns the component, which is not active yet.
  Component& add(std::unique_ptr<SystemInterface> system);
  [[nodiscard]] const std::vector<std::unique_ptr<Component>>& components() const { return components_; }
  [[nodiscard]] Component* find_component(std::string_view name) const;

  [[nodiscard]] std::size_t command_count() const { return commands_.size(); }
  [[nodiscard]] std::optional<std::size_t> find_command(std::string_view full_name) const;
  [[nodiscard]] std::optional<std::size_t> find_state(std::string_view full_name) const;
  [[nodiscard]] std::vector<std::string> command_names() const;
  [[nodiscard]] std::vector<std::string> state_names() const;

  [[nodiscard]] CommandHandle command_handle(std::size_t command) const;
  [[nodiscard]] StateHandle state_handle(std::size_t state) const;
  [[nodiscard]] const InterfaceDescription& command_description(std::size_t command) const;
  [[nodiscard]] const std::string& command_name(std::size_t command) const;
  [[nodiscard]] bool command_available(std::size_t command) const;  // its hardware is active
  [[nodiscard]] bool state_available(std::size_t state) const;      // its hardware is at least inactive
  [[nodiscard]] const Component& component_of_command(std::size_t command) const;
  [[nodiscard]] const Component& component_of_state(std::size_t state) const;
  double& asked(std::size_t command);
  double& applied(std::size_t command);
  [[nodiscard]] const double& state(std::size_t state) const;
  std::string& claimed_by(std::size_t command);

  // In the loop.
  void read(Time now, Duration period);
  void write(Time now, Duration period);

  // Asks or tells each component concerned about a switch; full names of command interfaces.
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop);
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop);

 private:
  struct Place {
    Component* component = nullptr;
    std::size_t index = 0;
  };
  using Action =
      std::function<Status(SystemInterface&, std::span<const std::string>, std::span<const std::string>)>;
  Status for_each_concerned(std::span<const std::string> start, std::span<const std::string> stop,
                            const Action& action);

  std::vector<std::unique_ptr<Component>> components_;
  std::vector<Place> commands_, states_;
  std::map<std::string, std::size_t, std::less<>> command_index_, state_index_;
};

}  // namespace doppel
