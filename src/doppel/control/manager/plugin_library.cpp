#include "doppel/control/manager/plugin_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>

namespace doppel {

void load_plugin_library(const std::string& path, ControllerRegistry& controllers,
                         HardwareRegistry& hardware) {
  std::error_code ignored;
  const bool exists = std::filesystem::exists(path, ignored);
  // dlopen() searches the system's folders for a name without a slash; an existing file has priority.
  const std::string file = exists ? std::filesystem::absolute(path, ignored).string() : path;
  void* library =
      dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);  // never closed: its code must outlive what it made
  if (library == nullptr) {
    const char* why = dlerror();
    throw InputError(
        "control.library", make_location(path),
        fmt::format("cannot load this plugin library: {}", why == nullptr ? "no reason given" : why),
        exists ? "build it against the headers of this doppel version" : "check the path");
  }
  using RegisterControllers = void (*)(ControllerRegistry&, const char*);
  using RegisterHardware = void (*)(HardwareRegistry&, const char*);
  const auto enter_controllers =
      reinterpret_cast<RegisterControllers>(dlsym(library, "doppel_register_controllers"));
  const auto enter_hardware = reinterpret_cast<RegisterHardware>(dlsym(library, "doppel_register_hardware"));
  if (enter_controllers == nullptr && enter_hardware == nullptr) {
    throw InputError("control.library", make_location(path),
                     "this library exports no controller and no hardware component",
                     "end its source with DOPPEL_EXPORT_CONTROLLER(my_package::MyController, "
                     "\"my_package/MyController\") or with DOPPEL_EXPORT_HARDWARE");
  }
  if (enter_controllers != nullptr) enter_controllers(controllers, path.c_str());
  if (enter_hardware != nullptr) enter_hardware(hardware, path.c_str());
}

}  // namespace doppel
