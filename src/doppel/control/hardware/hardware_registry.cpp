#include "doppel/control/hardware/hardware_registry.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/control/hardware/detail/builtin_hardware.h"

namespace doppel {

HardwareRegistry HardwareRegistry::with_builtin() {
  HardwareRegistry registry;
  register_builtin_hardware(registry);
  return registry;
}

void HardwareRegistry::add(std::string name, HardwareKind kind, Factory make, std::string library) {
  if (const Type* known = find(name)) {
    throw InputError("hardware.type_twice", {},
                     fmt::format("the hardware plugin '{}' of {} is already registered by {}", name,
                                 library.empty() ? "doppel" : library,
                                 known->library.empty() ? "doppel itself" : known->library),
                     "rename it, or load the library only once");
  }
  types_.push_back({std::move(name), std::move(library), kind, std::move(make)});
}

void HardwareRegistry::replace(std::string name, HardwareKind kind, Factory make) {
  std::erase_if(types_, [&](const Type& type) { return type.name == name; });
  types_.push_back({std::move(name), "", kind, std::move(make)});
}

const HardwareRegistry::Type* HardwareRegistry::find(std::string_view name) const {
  const auto found =
      std::find_if(types_.begin(), types_.end(), [&](const Type& t) { return t.name == name; });
  return found == types_.end() ? nullptr : &*found;
}

std::vector<std::string> HardwareRegistry::names() const {
  std::vector<std::string> out;
  for (const Type& type : types_) out.push_back(type.name);
  return out;
}

}  // namespace doppel
