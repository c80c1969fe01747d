#pragma once
// The meshes that a spawned object may have: files of the robot's own packages, so that a client cannot read
// arbitrary files of the machine by a service.

#include <filesystem>
#include <string>

#include "doppel/description/urdf/load.h"
#include "doppel/export.h"

namespace doppel {

// The file that a mesh's URI means: package:// (model://) below that package's folder, or file:// below the
// description's folder or its package's. A link may lead out of there only into another package, as `colcon
// build
// --symlink-install` makes them. STL, OBJ or COLLADA of at most 16 MB. Throws InputError.
DOPPEL_API std::filesystem::path find_entity_mesh(const std::string& uri, const PackageResolver& resolver,
                                                  const Target& target);

// The text of an SDF or URDF file (a path or file://) in a package, or of a model beside its model.config, which a client
// may name. Throws InputError.
DOPPEL_API std::string read_entity_file(const std::string& file);

// The nearest folder above the file that is a package; empty: there is none.
DOPPEL_API std::filesystem::path package_above(const std::filesystem::path& file);

}  // namespace doppel
