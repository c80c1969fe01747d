#pragma once
// Paths in a written document that are only valid on this machine.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

// A warning ("convert.absolute_path") for every value of the written URDF or SDF that is an absolute path,
// such as the parameter file of a Gazebo plugin: its readers support neither package:// nor paths relative to
// the document, so that no other form would be right. `file`: the path of the document.
DOPPEL_API void warn_of_absolute_paths(const std::string& document, const std::string& file,
                                       Diagnostics& diagnostics);

}  // namespace doppel
