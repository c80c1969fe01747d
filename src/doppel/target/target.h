#pragma once
// What belongs to a target: its packages, the arguments by which its description is one for simulation, and
// the files that it is made of. The controllers' files stand in controllers_search.h.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/load.h"
#include "doppel/export.h"

namespace doppel {

// The target that a word names, whose packages and those of the bundled robots `resolver` then knows. Throws
// InputError: nothing of that name.
DOPPEL_API Target find_target(const std::string& word, const std::filesystem::path& bundled_robots,
                              PackageResolver& resolver);

// One with the arguments that its description is expanded with.
struct OpenedTarget {
  Target target;
  XacroArguments arguments;
  PackageResolver resolver;  // knows the target's packages and the bundled robots
};
DOPPEL_API OpenedTarget open_target(const std::string& word, XacroArguments arguments,
                                    const std::filesystem::path& bundled_robots);

// xacro arguments by which descriptions choose between simulator and hardware.
DOPPEL_API bool switches_simulation(std::string_view argument);

// The arguments that a description is expanded with: the given ones and, where it declares one by which
// simulation is chosen (use_sim) and none is given, that one with a note.
DOPPEL_API XacroArguments simulation_arguments(const std::filesystem::path& description, XacroArguments given,
                                               const PackageResolver& resolver, Diagnostics& diagnostics);

// Expanded with its overlay and with the argument that chooses simulation; without that, and with a note,
// where only it keeps the description from being expanded. Throws InputError.
DOPPEL_API ExpandedDescription expand_for_simulation(const std::filesystem::path& description,
                                                     const XacroArguments& given, PackageResolver& resolver,
                                                     Diagnostics& diagnostics);

// Every file that a description was made of: its sources, its overlay (which may come later), its meshes.
DOPPEL_API std::vector<std::filesystem::path> files_of(const Target& target,
                                                       const LoadedDescription& description);

}  // namespace doppel
