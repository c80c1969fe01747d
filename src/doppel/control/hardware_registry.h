#pragma once
// Hardware components by the plugin names that descriptions write, and what each of them drives: the real
// thing, or a simulation that stands in for it.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/control/hardware.h"
#include "doppel/export.h"

namespace doppel {

enum class HardwareKind {
  real,       // a device, or what behaves as one: on the wall clock
  simulated,  // moves with the simulation, on its clock
};

class DOPPEL_API HardwareRegistry {
 public:
  using Factory = std::function<std::unique_ptr<HardwareComponent>()>;
  struct Type {
    std::string name, library;  // library: empty for those built in
    HardwareKind kind = HardwareKind::real;
    Factory make;
  };

  // With every component that the control stack has built in.
  static HardwareRegistry with_builtin();

  // Throws InputError where the name is registered already.
  void add(std::string name, HardwareKind kind, Factory make, std::string library = "");
  [[nodiscard]] const Type* find(std::string_view name) const;
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
