#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "doppel/control/controller.h"
#include "doppel/control/controllers/builtin.h"

namespace doppel {

ControllerRegistry ControllerRegistry::with_builtin() {
  ControllerRegistry registry;
  register_builtin_controllers(registry);
  return registry;
}

void ControllerRegistry::add(std::string name, Factory make, std::string library) {
  if (const Type* known = find(name)) {
    throw InputError("control.type_twice", {},
                     fmt::format("the controller type '{}' of {} is registered already, by {}", name,
                                 library.empty() ? "doppel" : library,
                                 known->library.empty() ? "doppel itself" : known->library),
                     "give it another name, or load the library once");
  }
  types_.push_back(
      {std::move(name), "controller_interface::ControllerInterface", std::move(library), std::move(make)});
}

void ControllerRegistry::load_library(const std::string& path) {
  std::error_code ignored;
  const bool exists = std::filesystem::exists(path, ignored);
  // A name without a slash would be looked for in the system's folders; a file that is there is meant.
  const std::string file = exists ? std::filesystem::absolute(path, ignored).string() : path;
  void* library =
      dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);  // never closed: controllers' code must outlive them
  if (library == nullptr) {
    const char* why = dlerror();
    throw InputError(
        "control.library", make_location(path),
        fmt::format("this controller library cannot be loaded: {}", why == nullptr ? "no reason given" : why),
        exists ? "build it against the headers of this doppel" : "check the path");
  }
  using Register = void (*)(ControllerRegistry&, const char*);
  const auto enter = reinterpret_cast<Register>(dlsym(library, "doppel_register_controllers"));
  if (enter == nullptr) {
    throw InputError("control.library", make_location(path), "this library exports no controller",
                     "end its source with DOPPEL_EXPORT_CONTROLLER(my_package::MyController, "
                     "\"my_package/MyController\")");
  }
  enter(*this, path.c_str());
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
