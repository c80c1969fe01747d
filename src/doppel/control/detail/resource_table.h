#pragma once
// The hardware components and their interfaces: who offers what, who holds which command. Addresses of values
// stay valid for the table's life. Commands are kept twice: as controllers wrote them, and as they went out
// after the limits. What a component throws ends here, as a fault of that component.

#include <array>
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

// What was thrown in the loop, as text that is cut off where it is too long; empty: nothing was.
using LoopExceptionText = std::array<char, 200>;
// Of the exception that is being handled. Without allocation.
void note_thrown(LoopExceptionText& text) noexcept;

// A read, write or switch of a component that was not ok, until it is handled between two cycles.
struct HardwareFault {
  const char* during = nullptr;  // "read"; null: none
  HardwareReturn answer = HardwareReturn::ok;
  LoopExceptionText thrown{};
  [[nodiscard]] bool any() const { return during != nullptr; }
};

class ResourceTable {
 public:
  struct Component {
    std::string name, type, plugin;  // type: "system", "actuator", "sensor"
    bool is_async = false;
    std::unique_ptr<HardwareComponent> hardware;
    HardwareState state = HardwareState::unconfigured;
    std::vector<InterfaceDescription> state_descriptions, command_descriptions;
    std::vector<std::string> state_names, command_names;  // full names
    std::vector<double> states, asked, applied;           // asked: by controllers; applied: to the hardware
    std::vector<std::string> claimed_by;                  // of each command; empty: nobody
    std::size_t first_command = 0;                        // its index among all commands
    int ticks_per_rw = 1, ticks_to_rw = 1;
    Duration period{};   // of read and write
    double rw_rate = 0;  // Hz; of an asynchronous one, that of its own thread
    HardwareFault fault;
    std::string why;  // it is not what it was started as, in words; empty: nothing has failed
    [[nodiscard]] bool is_read() const {
      return state == HardwareState::inactive || state == HardwareState::active;
    }
  };

  // `hardware` has been initialised; it is read and written every `ticks_per_rw` ticks of length `tick`.
  // Throws InputError where an interface is offered already. Returns the component, unconfigured.
  Component& add(std::unique_ptr<HardwareComponent> hardware, const HardwareDescription& description,
                 int ticks_per_rw, Duration tick);
  [[nodiscard]] const std::vector<std::unique_ptr<Component>>& components() const { return components_; }
  [[nodiscard]] Component* find_component(std::string_view name) const;

  // The reference interface of a chainable controller, by its full name: a command of no hardware, whose
  // component is named after the controller. Returns its index, which it keeps when it is offered again;
  // `added`: it was not there before. Available while set_references() says so.
  std::size_t offer_reference(const std::string& controller, InterfaceDescription description, bool& added);
  void withdraw_reference(const std::string& full_name);
  void set_references(const std::string& controller, bool available);
  // Of a reference; null: hardware offers this command.
  [[nodiscard]] const std::string* controller_of(std::size_t command) const;

  // Of what is offered now, in the order of offering.
  [[nodiscard]] std::vector<std::size_t> commands() const;
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

  // In the loop: those that are due. A component with a fault is left alone until it is cleared.
  void read(Time now);
  void write(Time now);
  // Some component has a fault that is not handled yet.
  [[nodiscard]] bool has_fault() const { return has_fault_; }
  // Between ticks: everything, due or not.
  void read_all(Time now);
  // Between ticks: a call of a component; what it throws is its fault.
  void call(Component& component, const char* during, const std::function<void(HardwareComponent&)>& call);
  // Hands out each component's fault, once.
  [[nodiscard]] std::vector<std::pair<Component*, HardwareFault>> take_faults();

  // While stopped, nothing is written.
  void set_stopped(bool stopped) { stopped_ = stopped; }

  // Asks or tells each component concerned about a switch; full names of command interfaces.
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop);
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop);
  // Writes the last commands of those whose claims are about to end.
  void write_last(Time now, std::span<const std::string> commands);

 private:
  struct Place {
    Component* component = nullptr;
    std::size_t index = 0;
  };
  using Action =
      std::function<Status(Component&, std::span<const std::string>, std::span<const std::string>)>;
  template <class Call>
  void guarded(Component& component, const char* during, const Call& call) noexcept;
  void read(Component& component, Time now);
  void write(Component& component, Time now);
  Status for_each_concerned(std::span<const std::string> start, std::span<const std::string> stop,
                            const Action& action);

  std::vector<std::unique_ptr<Component>> components_;
  std::vector<std::unique_ptr<Component>> references_;  // one interface each, without hardware
  std::vector<Place> commands_, states_;
  std::map<std::string, std::size_t, std::less<>> command_index_, state_index_;
  bool has_fault_ = false, stopped_ = false;
};

}  // namespace doppel
