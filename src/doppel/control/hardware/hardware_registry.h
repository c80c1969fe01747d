#pragma once
// Hardware components by the plugin names of descriptions, and whether each of them drives a real device
// or a simulation.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/export.h"

namespace doppel {

// The thing behind a component, and the clock that it has.
enum class HardwareKind {
  real,       // a device, or a stand-in for one: the system's clock
  emulated,   // the driver of a device whose bus and motors are part of the simulation: simulated time
  simulated,  // a part of the simulation: simulated time
};
constexpr bool has_wall_clock(HardwareKind kind) {
  return kind == HardwareKind::real;
}

class DOPPEL_API HardwareRegistry {
 public:
  using Factory = std::function<std::unique_ptr<HardwareComponent>()>;
  struct Type {
    std::string name, library;  // library: empty for those built in
    HardwareKind kind = HardwareKind::real;
    Factory make;
  };

  // With all built-in components of the control stack.
  static HardwareRegistry with_builtin();

  // Throws InputError if the name is already registered.
  void add(std::string name, HardwareKind kind, Factory make, std::string library = "");
  // Adds it, in place of the one with this name.
  void replace(std::string name, HardwareKind kind, Factory make);
  [[nodiscard]] const Type* find(std::string_view name) const;  // nullptr: unknown
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::vector<Type> types_;
};

}  // namespace doppel

#define DOPPEL_EXPORT_HARDWARE(Class, plugin_name)                                                   \
  extern "C" DOPPEL_API void doppel_register_hardware(doppel::HardwareRegistry& registry,            \
                                                      const char* library) {                         \
    registry.add(                                                                                    \
        plugin_name, doppel::HardwareKind::real, [] { return std::make_unique<Class>(); }, library); \
  }
