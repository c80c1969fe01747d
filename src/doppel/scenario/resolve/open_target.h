#pragma once
// The input of a target: its packages, the arguments that select simulation, and its files. Controllers'
// files are in controllers_search.h.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"

namespace doppel {

// The target of an argument; adds its packages and the bundled robots to `resolver`. Throws InputError: there
// is no such target.
DOPPEL_API Target find_target(const std::string& word, const std::filesystem::path& bundled_robots,
                              PackageResolver& resolver);

// A target with the arguments for the expansion of its description.
struct OpenedTarget {
  Target target;
  XacroArguments arguments;
  PackageResolver resolver;  // with the target's packages and the bundled robots
};
DOPPEL_API OpenedTarget open_target(const std::string& word, XacroArguments arguments,
                                    const std::filesystem::path& bundled_robots);

// True if it is a xacro argument by which descriptions select simulator or hardware.
DOPPEL_API bool switches_simulation(std::string_view argument);

// The argument that selects hardware, "use_sim:=false" or "use_real_hardware:=true"; empty: none does.
DOPPEL_API std::string hardware_argument(const XacroArguments& arguments);

// The arguments for the expansion of a description with its hardware: the given ones and, if it declares
// one that selects simulation and it is not given, that one with the other value.
DOPPEL_API XacroArguments hardware_arguments(const std::filesystem::path& description,
                                             XacroArguments arguments, const PackageResolver& resolver);

// The arguments for the expansion of a description: the given ones and, if it declares one that selects
// simulation (use_sim) and it is not given, that one with a note.
DOPPEL_API XacroArguments simulation_arguments(const std::filesystem::path& description,
                                               XacroArguments arguments, const PackageResolver& resolver,
                                               Diagnostics& diagnostics);

// Expands the description with its overlay and the argument that selects simulation; without that argument,
// and with a note, if the expansion fails only because of it. `arguments`: the given ones, afterwards those
// of the expansion. Throws InputError.
DOPPEL_API ExpandedDescription expand_for_simulation(const std::filesystem::path& description,
                                                     XacroArguments& arguments, PackageResolver& resolver,
                                                     Diagnostics& diagnostics);

// All files of a description: its sources, their overlays (which may not exist yet), its meshes.
DOPPEL_API std::vector<std::filesystem::path> files_of(const Target& target,
                                                       const LoadedDescription& description);

}  // namespace doppel
