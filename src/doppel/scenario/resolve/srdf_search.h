#pragma once
// The semantic descriptions (SRDF) that belong to a robot: files with its name in <robot name="...">, and
// with its links and joints; beside its description, in its package, and in packages for MoveIt beside that.

#include <filesystem>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/description/srdf/srdf.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"

namespace doppel {

struct FoundSrdf {
  std::filesystem::path file;
  SrdfDescription srdf;
  Diagnostics diagnostics;  // of its reading
};

// In the order of the search, each file once. The user has not named these files, so that one that cannot be
// read is a note in `skipped`; xacro is expanded with the defaults of its arguments.
DOPPEL_API std::vector<FoundSrdf> find_srdf(const RobotDescription& robot, const Target& target,
                                            PackageResolver& resolver, Diagnostics& skipped);

}  // namespace doppel
