#pragma once
// Engines are plugin modules, libdoppel_engine_<name>.so, loaded when they are first used, so that a verb
// without physics loads none. A module is built where its library's development package is found.

#include <memory>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

struct DOPPEL_API EngineModule {
  EngineCapabilities capabilities;
  // Any thread. Throws InputError, with the link or joint and its place, where the engine rejects the world.
  std::shared_ptr<const CompiledWorld> (*compile)(WorldSettings settings,
                                                  std::vector<ModelInstance> instances,
                                                  Diagnostics& diagnostics) = nullptr;
};

inline constexpr const char* kDefaultEngine = "mujoco";

// An engine that doppel supports: whether its module is installed, and the package to install otherwise.
struct KnownEngine {
  std::string name, package;  // "bullet", "libbullet-dev"
  bool available = false;
};
DOPPEL_API std::vector<KnownEngine> known_engines();

// Loads the module when it is first requested. Throws InputError: no engine of this name (with the nearest
// name), or one that is not built here (with the package to install).
DOPPEL_API const EngineModule& engine_module(const std::string& name);
// Adds an engine that is linked into the program, as the analytic engine of the tests.
DOPPEL_API void register_engine(EngineModule module);

// One warning for each feature that the instances and settings need and the engine lacks, with the joint,
// link or key and the effect.
DOPPEL_API void report_missing_capabilities(const EngineCapabilities& engine, const WorldSettings& settings,
                                            std::span<const ModelInstance> instances,
                                            Diagnostics& diagnostics);

// compile() of the named engine after report_missing_capabilities().
DOPPEL_API std::shared_ptr<const CompiledWorld> compile_world(const std::string& engine,
                                                              WorldSettings settings,
                                                              std::vector<ModelInstance> instances,
                                                              Diagnostics& diagnostics);

}  // namespace doppel

// Ends the source of a module.
#define DOPPEL_EXPORT_ENGINE(module)                                         \
  extern "C" DOPPEL_API const doppel::EngineModule* doppel_engine_module() { \
    return &(module);                                                        \
  }
