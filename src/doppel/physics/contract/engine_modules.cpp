#include "doppel/physics/contract/engine_modules.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "doppel/base/core/names.h"
#include "doppel/base/core/plugin_module.h"

namespace doppel {
namespace {

struct Known {
  const char *name, *package, *option;  // option: how a build that has the engine is configured
};
constexpr Known kKnown[] = {{"mujoco", "libmujoco-dev", ""},
                            {"bullet", "libbullet-dev", ", configure with -DDOPPEL_WITH_BULLET=ON"}};

std::string library_of(const std::string& engine) {
  return "doppel_engine_" + engine;
}

// The modules that are loaded or registered.
struct Registry {
  std::mutex mutex;
  std::map<std::string, EngineModule> modules;
};

Registry& registry() {
  static Registry instance;
  return instance;
}

[[noreturn]] void refuse(const std::string& name, const std::vector<std::string>& names) {
  const auto known = std::ranges::find(kKnown, name, &Known::name);
  if (known != std::end(kKnown)) {
    throw InputError(
        "physics.engine_missing", {},
        fmt::format("the engine '{}' is not built here: its library is missing", name),
        fmt::format("install {}{} and build again (`doppel engines` lists the available engines)",
                    known->package, known->option));
  }
  throw InputError("physics.unknown_engine", {},
                   fmt::format("there is no engine '{}'{}", name, did_you_mean(name, names)),
                   "`doppel engines` lists the available engines");
}

}  // namespace

std::vector<KnownEngine> known_engines() {
  std::vector<KnownEngine> out;
  for (const Known& known : kKnown)
    out.push_back({known.name, known.package, plugin_module_exists(library_of(known.name))});
  const std::lock_guard lock(registry().mutex);
  for (const auto& [name, module] : registry().modules) {
    if (std::ranges::find(out, name, &KnownEngine::name) == out.end()) out.push_back({name, "", true});
  }
  return out;
}

const EngineModule& engine_module(const std::string& name) {
  {
    const std::lock_guard lock(registry().mutex);
    const auto found = registry().modules.find(name);
    if (found != registry().modules.end()) return found->second;
  }
  std::vector<std::string> names;
  bool there = false;
  for (const KnownEngine& known : known_engines()) {
    names.push_back(known.name);
    there = there || (known.name == name && known.available);
  }
  if (!there) refuse(name, names);
  using Export = const EngineModule* (*)();
  const auto exported =
      reinterpret_cast<Export>(plugin_symbol(library_of(name), "doppel_engine_module"));  // NOLINT
  const std::lock_guard lock(registry().mutex);
  return registry().modules.emplace(name, *exported()).first->second;
}

void register_engine(EngineModule module) {
  const std::lock_guard lock(registry().mutex);
  registry().modules[module.capabilities.name] = std::move(module);
}

std::shared_ptr<const CompiledWorld> compile_world(const std::string& engine, WorldSettings settings,
                                                   std::vector<ModelInstance> instances,
                                                   Diagnostics& diagnostics) {
  const EngineModule& module = engine_module(engine);
  report_missing_capabilities(module.capabilities, settings, instances, diagnostics);
  return module.compile(std::move(settings), std::move(instances), diagnostics);
}

}  // namespace doppel
