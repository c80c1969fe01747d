#pragma once
// The hardware components, their interfaces and the claims on commands. Addresses of values are valid for the
// table's life. Commands are stored twice: as controllers wrote them, and as applied after the limits. An
// exception of a component is caught here and becomes a fault of that component.

#include <array>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/controller.h"

namespace doppel {

// The text of an exception in the loop, truncated to the array; empty: none.
using LoopExceptionText = std::array<char, 200>;
// Writes the text of the exception that is being handled. Does not allocate.
void note_thrown(LoopExceptionText& text) noexcept;

// A failed read, write or switch of a component, until it is handled between two cycles.
struct HardwareFault {
  const char* during = nullptr;  // "read"; nullptr: no fault
  HardwareReturn answer = HardwareReturn::ok;
  LoopExceptionText thrown{};
  [[nodiscard]] bool any() const { return during != nullptr; }
};

// The values of all components and references, as they were when they were saved.
struct SavedResources {
  struct One {
    std::string name;
    HardwareState state = HardwareState::unconfigured;
    std::vector<double> states, asked, applied;
    int ticks_to_rw = 1;
    std::string why;
    bool not_finite_reported = false;
    SavedSlot run;
  };
  std::vector<One> components, references;
};

class ResourceTable {
 public:
  struct Component {
    std::string name, type, plugin;  // type: "system", "actuator", "sensor"
    bool is_async = false;
    std::unique_ptr<HardwareComponent> hardware;
    std::atomic<HardwareState> state{HardwareState::unconfigured};  // also read by the loop's watchdog
    std::vector<InterfaceDescription> state_descriptions, command_descriptions;
    std::vector<std::string> state_names, command_names;  // full names
    std::vector<double> states, asked, applied;           // asked: by controllers; applied: to the hardware
    std::vector<std::string> claimed_by;                  // of each command; empty: not claimed
    std::size_t first_command = 0;                        // its index among all commands
    int ticks_per_rw = 1, ticks_to_rw = 1;
    Duration period{};   // of read and write
    double rw_rate = 0;  // Hz; of an asynchronous one, that of its own thread
    HardwareFault fault;
    std::string why;  // the reason why it left its initial state; empty: nothing has failed
    std::vector<std::size_t> joint_states;  // those of `states` that a joint always has a finite value of
    std::optional<std::size_t> not_finite;  // the first of them that is NaN or infinite since the last read
    bool not_finite_reported = false;       // since its activation
    [[nodiscard]] bool is_read() const {
      return state == HardwareState::inactive || state == HardwareState::active;
    }
  };

  // `hardware` has been initialised; it is read and written every `ticks_per_rw` ticks of length `tick`.
  // Throws InputError if an interface already exists. Returns the component, unconfigured.
  Component& add(std::unique_ptr<HardwareComponent> hardware, const HardwareDescription& description,
                 int ticks_per_rw, Duration tick);
  [[nodiscard]] const std::vector<std::unique_ptr<Component>>& components() const { return components_; }
  [[nodiscard]] Component* find_component(std::string_view name) const;

  // Adds the reference interface of a chainable controller: a command without hardware, whose component is
  // named after the controller. Returns its index, which it keeps when it is added again; `added`: it is new.
  // It is available as set by set_references().
  std::size_t offer_reference(const std::string& controller, InterfaceDescription description, bool& added);
  void withdraw_reference(const std::string& full_name);
  void set_references(const std::string& controller, bool available);
  // The controller of a reference interface; nullptr: a command of hardware.
  [[nodiscard]] const std::string* controller_of(std::size_t command) const;

  // The present interfaces, in the order in which they were added.
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

  // In the loop: the components that are due. A component with a fault is skipped until the fault is handled.
  void read(Time now);
  void write(Time now);
  // True if a component has a fault that is not handled yet.
  [[nodiscard]] bool has_fault() const { return has_fault_; }
  // Between ticks: all components, due or not.
  void read_all(Time now);
  // Between ticks: every component logs what has happened in the loop.
  void attend();
  // Between ticks: calls a component; an exception becomes its fault.
  void call(Component& component, const char* during, const std::function<void(HardwareComponent&)>& call);
  // Returns and clears the faults of all components.
  [[nodiscard]] std::vector<std::pair<Component*, HardwareFault>> take_faults();

  // True: a component has read a joint's state that is not finite, which is not reported yet.
  [[nodiscard]] bool has_not_finite() const { return has_not_finite_; }
  // Returns those components and takes them as reported until their next activation.
  [[nodiscard]] std::vector<Component*> take_not_finite();

  // Between ticks: the commands of a component get their initial values again, because those from before a
  // stop or before its activation must not be written afterwards.
  static void forget_commands(Component& component);

  // Between ticks. Refused with the names of components that cannot be saved.
  Status save(SavedResources& out) const;
  // Between ticks: the life cycle of every component is in the same state. Faults since then are forgotten.
  void restore(const SavedResources& saved);

  // While stopped, nothing is written.
  void set_stopped(bool stopped) { stopped_ = stopped; }

  // Calls prepare_switch or perform_switch of each component concerned; full names of command interfaces.
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop);
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop);
  // Writes the last values of commands whose claims are about to end.
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
  bool has_fault_ = false, has_not_finite_ = false, stopped_ = false;
};

}  // namespace doppel
