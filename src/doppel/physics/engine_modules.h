#pragma once
// Engines are modules beside the program, lib"doppel_engine_<name>".so, loaded when they are chosen: what
// needs no physics loads none. A module is built where its library's development package is found.

#include <memory>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/engine.h"

namespace doppel {

struct DOPPEL_API EngineModule {
  EngineCapabilities capabilities;
  // Throws InputError where the engine refuses the world, in the user's terms (link or joint and its place).
  std::shared_ptr<const CompiledWorld> (*compile)(WorldSettings settings,
                                                  std::vector<ModelInstance> instances,
                                                  Diagnostics& diagnostics) = nullptr;
};

inline constexpr const char* kDefaultEngine = "mujoco";

// An engine that doppel knows: whether its module is there, and what to install where it is not.
struct KnownEngine {
  std::string name, package;  // "bullet", "libbullet-dev"
  bool available = false;
};
DOPPEL_API std::vector<KnownEngine> known_engines();

// Loads the module when it is first requested. Throws InputError: no engine of this name (with the nearest),
// or one that is not built here (with the package to install).
DOPPEL_API const EngineModule& engine_module(const std::string& name);
// Another engine of the program's own: tests have one.
DOPPEL_API void register_engine(EngineModule module);

// What the instances and settings need that the engine lacks, each a warning that names the joint, link or
// key and says what happens instead.
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
