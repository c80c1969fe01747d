#include <fmt/format.h>

#include <algorithm>

#include "doppel/control/manager/controller.h"

namespace doppel {

void ControllerRegistry::add(std::string name, Factory make, std::string library) {
  if (const Type* known = find(name)) {
    throw InputError("control.type_twice", {},
                     fmt::format("the controller type '{}' of {} is already registered by {}", name,
                                 library.empty() ? "doppel" : library,
                                 known->library.empty() ? "doppel itself" : known->library),
                     "rename it, or load the library only once");
  }
  types_.push_back(
      {std::move(name), "controller_interface::ControllerInterface", std::move(library), std::move(make)});
}

const ControllerRegistry::Type* ControllerRegistry::find(std::string_view name) const {
  const auto found =
      std::find_if(types_.begin(), types_.end(), [&](const Type& t) { return t.name == name; });
  return found == types_.end() ? nullptr : &*found;
}

std::vector<std::string> ControllerRegistry::names() const {
  std::vector<std::string> out;
  for (const Type& type : types_) out.push_back(type.name);
  return out;
}

}  // namespace doppel
