#pragma once
// $(find NAME) in a plain URDF, which keeps it where it is always run through xacro.

#include <string>

#include "doppel/export.h"
#include "doppel/packages/package_resolver.h"

namespace doppel {

// `text` with the folder of the package in place of its first $(find NAME); as it is where there is none, or
// the package is not found.
DOPPEL_API std::string with_found_package(std::string text, const PackageResolver& resolver);

}  // namespace doppel
