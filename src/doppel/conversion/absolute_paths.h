#pragma once
// Paths that only this machine has, in a document that is meant to travel.

#include <string>

#include "doppel/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

// A warning ("convert.absolute_path") for every value of the written URDF or SDF that is an absolute path,
// such as the parameter file of a Gazebo plugin: its readers know neither package:// nor the document's
// folder, so that no other way to write it would be right. `file`: where it is written.
DOPPEL_API void warn_of_absolute_paths(const std::string& document, const std::string& file,
                                       Diagnostics& diagnostics);

}  // namespace doppel
